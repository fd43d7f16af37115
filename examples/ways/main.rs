//! Writes the recordings of the worked examples in `docs/ways`, each into its own folder, together with the torque
//! from which they were made.
//!
//! ```text
//! cargo run --example ways -- FOLDER
//! ```

#[path = "../../tests/mcap_file.rs"]
#[allow(dead_code)] // ROS 2 messages here have no lists
mod mcap_file;
#[path = "../../tests/noise.rs"]
mod noise;
#[path = "../../tests/ways/records/mod.rs"]
mod records;

use std::path::PathBuf;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = std::env::args_os()
        .nth(1)
        .map(PathBuf::from)
        .ok_or("usage: cargo run --example ways -- FOLDER")?;
    for way in records::ways() {
        let place = folder.join(way.name);
        std::fs::create_dir_all(&place)?;
        for (name, content) in way.files {
            std::fs::write(place.join(name), content)?;
        }
        let row =
            |(i, torque): (usize, &f64)| format!("{:.6},{torque:.6}\n", i as f64 / way.rate_hz);
        let rows: String = way.applied_n_m.iter().enumerate().map(row).collect();
        let applied = format!("time_s,applied_torque_n_m\n{rows}");
        std::fs::write(place.join("applied.csv"), applied)?;
        println!("{}", place.display());
    }
    Ok(())
}
