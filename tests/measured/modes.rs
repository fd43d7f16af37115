//! Several modes of third-party recordings, written to a stand file and simulated from it.

use std::ops::Range;
use std::path::Path;

use libtest_mimic::Failed;
use torqcomp_dsp::frf::{self, Block, Estimator, Frf, Window};

use super::{HAMMER, check, rows};

/// A folder for stand files.
struct Bench {
    folder: tempfile::TempDir,
}

impl Bench {
    fn run(&self, args: &[&str]) -> Result<String, Failed> {
        let output = std::process::Command::new(env!("CARGO_BIN_EXE_torqcomp"))
            .args(args)
            .current_dir(self.folder.path())
            .output()?;
        let err = String::from_utf8_lossy(&output.stderr).into_owned();
        check(output.status.success(), err)?;
        Ok(String::from_utf8_lossy(&output.stdout).into_owned())
    }

    /// Writes the modes of some files.
    fn fit(&self, fitted: &[&str], options: &[&str], modes: &str) -> Result<(), Failed> {
        let write = ["--modes", modes, "-o", "stand.toml", "--force"];
        self.run(&[&["identify", "response"], fitted, options, &write].concat())?;
        Ok(())
    }

    /// The simulated record of a file.
    fn simulated(&self, options: &[&str], file: &str) -> Result<Vec<f64>, Failed> {
        let simulate = ["simulate", file, "--stand", "stand.toml", "-o", "-"];
        let out = self.run(&[&simulate, &options[..2]].concat())?;
        Ok(rows(&out).into_iter().map(|row| row[1]).collect())
    }
}

/// Relative difference between a simulated and the measured record, over lines of their spectra.
fn apart(simulated: &[f64], block: &Block, window: Window, lines: Range<usize>) -> f64 {
    let spectrum = frf::transform(simulated, simulated, window).measured;
    let ratio = |k: usize| spectrum[k] / block.applied[k];
    let response: Vec<_> = lines.clone().map(ratio).collect();
    frf::prediction_error(&response, block, lines)
}

/// Force and acceleration of a hit, without the preceding level.
fn hit(file: &Path) -> Result<[Vec<f64>; 2], Failed> {
    let text = std::fs::read_to_string(file)?;
    let table = text.rsplit("X_Value").next().unwrap_or_default();
    let mut both = [Vec::new(), Vec::new()];
    for line in table.lines().skip(1) {
        let cells = line.split('\t').skip(1);
        for (channel, cell) in both.iter_mut().zip(cells) {
            channel.push(cell.parse::<f64>()?);
        }
    }
    for channel in &mut both {
        let level = channel[..20].iter().sum::<f64>() / 20.0;
        channel.iter_mut().for_each(|value| *value -= level);
    }
    Ok(both)
}

/// The third hit from the modes of two others, 60 to 1000 Hz, with the usual exponential window to 1 %.
pub fn hammer(folder: &Path) -> Result<(), Failed> {
    let bench = Bench {
        folder: tempfile::tempdir()?,
    };
    let files = [1, 2, 3].map(|k| folder.join(format!("hammer/hit{k}.lvm")));
    let paths = files.each_ref().map(|p| p.to_str().unwrap_or_default());
    let hits = files.iter().map(|file| hit(file));
    let hits = hits.collect::<Result<Vec<_>, _>>()?;
    let window = Window::Exponential(hits[0][0].len() as f64 / 100_f64.ln());
    let block = |[force, acceleration]: &[Vec<f64>; 2]| frf::transform(force, acceleration, window);
    let blocks: Vec<Block> = hits.iter().map(block).collect();
    // A second of each hit.
    let lines = 60..1001;
    let raw = Frf::between(blocks[..2].iter(), Estimator::H1, lines.clone()).response;
    let floor = frf::prediction_error(&raw, &blocks[2], lines.clone());
    for (modes, most) in [("8", 0.08), ("18", 0.055)] {
        bench.fit(&paths[..2], &HAMMER, modes)?;
        let got = bench.simulated(&HAMMER, paths[2])?;
        let error = apart(&got, &blocks[2], window, lines.clone());
        println!("{modes} modes: {error:.4}, the response itself: {floor:.4}");
        check(error < most, format!("{modes} modes: {error}, {floor}"))?;
    }
    Ok(())
}

/// The modes of one level at that level and at the other: the last of three periods, 2 to 15 Hz, compared with the
/// response of that level itself, the best possible linear model at the other.
pub fn f16(folder: &Path) -> Result<(), Failed> {
    const PERIOD: usize = 8192;
    let bench = Bench {
        folder: tempfile::tempdir()?,
    };
    let files = [1, 3].map(|level| folder.join(format!("f16/multisine_level{level}.csv")));
    let paths = files.each_ref().map(|p| p.to_str().unwrap_or_default());
    let mut blocks = Vec::new();
    for file in &files {
        let table = rows(&std::fs::read_to_string(file)?);
        let column = |k: usize| {
            table[2 * PERIOD..]
                .iter()
                .map(|row| row[k])
                .collect::<Vec<f64>>()
        };
        blocks.push(frf::transform(&column(1), &column(4), Window::None));
    }
    let lines = 41..308;
    let options = [
        "--applied",
        "force_N",
        "--measured",
        "accel_payload",
        "--measured-as",
        "acceleration",
        "--band",
        "2..15",
    ];
    for fitted in [0, 1] {
        let other = 1 - fitted;
        let raw = Frf::between(
            std::iter::once(&blocks[fitted]),
            Estimator::H1,
            lines.clone(),
        )
        .response;
        let best = frf::prediction_error(&raw, &blocks[other], lines.clone());
        bench.fit(&paths[fitted..=fitted], &options, "8")?;
        let error = |level: usize| -> Result<f64, Failed> {
            let got = bench.simulated(&options, paths[level])?;
            let last = &got[2 * PERIOD..];
            Ok(apart(last, &blocks[level], Window::None, lines.clone()))
        };
        let (own, there) = (error(fitted)?, error(other)?);
        println!(
            "fitted at {fitted}: {own:.3}, at the other level {there:.3}, the response itself there {best:.3}"
        );
        check(own < 0.25, format!("{own}"))?;
        check(there < best + 0.02, format!("{there} {best}"))?;
    }
    Ok(())
}
