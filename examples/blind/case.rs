//! A case on disk, and the answer of `torqcomp diagnose`.

use std::io;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

use serde_json::Value;

/// Torque per recorded volt of the declared stand in N m: 1.23e3 ft lbf.
const N_M_PER_VOLT: f64 = 1.23e3 * 1.355_817_948_331_400_4;

/// A folder containing a case.
pub struct Case {
    pub folder: PathBuf,
    pub truth: Value,
}

/// The answer.
pub struct Answer {
    pub case: Case,
    /// Exit code; `None` if killed.
    pub code: Option<i32>,
    /// The JSON, or null.
    pub json: Value,
    pub stderr: String,
    /// Wall time, and CPU time if available and nothing else runs.
    pub seconds: f64,
    pub processor_seconds: Option<f64>,
    pub refined: PathBuf,
}

impl Case {
    /// Reads every case below a folder, sorted by path.
    pub fn read_all(folder: &Path) -> io::Result<Vec<Self>> {
        let mut cases = Vec::new();
        for effect in sorted(folder)? {
            for number in sorted(&effect)? {
                // A case without its truth is still being written.
                if let Ok(text) = std::fs::read_to_string(number.join("truth.json")) {
                    let truth = serde_json::from_str(&text)?;
                    cases.push(Self {
                        folder: number,
                        truth,
                    });
                }
            }
        }
        Ok(cases)
    }

    pub fn effect(&self) -> &str {
        self.truth["effect"].as_str().unwrap_or_default()
    }

    /// The effects in the record, in alphabetical order.
    pub fn effects(&self) -> Vec<&str> {
        let list = self.truth["effects"].as_array();
        let names = list.into_iter().flatten().filter_map(Value::as_str);
        let mut names: Vec<&str> = names.collect();
        names.sort_unstable();
        names
    }

    pub fn variant(&self) -> &str {
        self.truth["variant"].as_str().unwrap_or_default()
    }

    pub fn number(&self) -> u64 {
        self.truth["number"].as_u64().unwrap_or_default()
    }

    pub fn column(&self) -> &str {
        self.truth["measured_column"].as_str().unwrap_or_default()
    }

    /// Strength in training and hold-out data.
    pub fn strength(&self) -> [f64; 2] {
        ["train", "holdout"].map(|key| self.truth["strength"][key].as_f64().unwrap_or(f64::NAN))
    }

    /// Noise in the hold-out record, rms.
    pub fn floor(&self) -> f64 {
        self.truth["noise"]["holdout_rms_n_m"]
            .as_f64()
            .unwrap_or(f64::NAN)
    }

    /// Hold-out error of the best plain fit.
    pub fn plain_error(&self) -> f64 {
        self.truth["plain_fit"]["holdout_rms_with_noise_n_m"]
            .as_f64()
            .unwrap_or(f64::NAN)
    }

    /// Runs the binary, or uses the result of an earlier run.
    pub fn diagnose(self, binary: &Path, answers: &Path, reuse: bool) -> io::Result<Answer> {
        let folder = answers
            .join(self.effect())
            .join(format!("{:03}", self.number()));
        std::fs::create_dir_all(&folder)?;
        let (saved, refined) = (folder.join("answer.json"), folder.join("refined.toml"));
        let old = if reuse {
            std::fs::read_to_string(&saved).ok()
        } else {
            None
        };
        let record = match old {
            Some(text) => serde_json::from_str(&text)?,
            None => {
                let record = self.run(binary, &refined)?;
                std::fs::write(&saved, format!("{record:#}\n"))?;
                record
            }
        };
        Ok(Answer {
            code: record["code"]
                .as_i64()
                .and_then(|code| i32::try_from(code).ok()),
            json: record["answer"].clone(),
            stderr: record["stderr"].as_str().unwrap_or_default().to_owned(),
            seconds: record["seconds"].as_f64().unwrap_or(f64::NAN),
            processor_seconds: record["processor_seconds"].as_f64(),
            refined,
            case: self,
        })
    }

    fn run(&self, binary: &Path, refined: &Path) -> io::Result<Value> {
        let (start, spent) = (Instant::now(), children_seconds());
        let output = Command::new(binary)
            .current_dir(&self.folder)
            .args(["diagnose", "--stand", "stand.toml", "--train", "train.csv"])
            .args(["--holdout", "holdout.csv", "--applied", "applied_n_m"])
            .args(["--measured", self.column(), "--json", "--force", "-o"])
            .arg(refined)
            .output()?;
        Ok(serde_json::json!({
            "code": output.status.code(),
            "seconds": start.elapsed().as_secs_f64(),
            "processor_seconds": children_seconds().zip(spent).map(|(now, then)| now - then),
            "answer": serde_json::from_slice::<Value>(&output.stdout).unwrap_or(Value::Null),
            "stderr": String::from_utf8_lossy(&output.stderr),
        }))
    }
}

/// CPU time of finished child processes, from `/proc` (Linux, 100 ticks per second).
fn children_seconds() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/self/stat").ok()?;
    // The first field after the name in brackets is field 3 of the line; 16 and 17 are those of the children.
    let fields: Vec<&str> = text.rsplit_once(')')?.1.split_whitespace().collect();
    let ticks = |field: usize| fields.get(field - 3)?.parse::<f64>().ok();
    Some((ticks(16)? + ticks(17)?) / 100.0)
}

fn sorted(folder: &Path) -> io::Result<Vec<PathBuf>> {
    let mut paths: Vec<PathBuf> = std::fs::read_dir(folder)?
        .map(|entry| entry.map(|entry| entry.path()))
        .collect::<io::Result<_>>()?;
    paths.retain(|path| path.is_dir());
    paths.sort();
    Ok(paths)
}

impl Answer {
    pub fn verdict(&self) -> &str {
        self.json["verdict"].as_str().unwrap_or("failed")
    }

    pub fn effects(&self) -> Vec<&str> {
        let list = self.json["effects"]
            .as_array()
            .map_or(&[][..], Vec::as_slice);
        list.iter().filter_map(Value::as_str).collect()
    }

    /// Hold-out error in N m of `declared`, `before` or `after`.
    pub fn error(&self, which: &str) -> f64 {
        let error = &self.json["error"];
        let scale = match error["unit"].as_str() {
            Some("V") => N_M_PER_VOLT,
            Some("mV") => 1e-3 * N_M_PER_VOLT,
            _ => 1.0,
        };
        error[which]["holdout_rms"]
            .as_f64()
            .map_or(f64::NAN, |rms| rms * scale)
    }

    /// Error after over the noise.
    pub fn after_over_floor(&self) -> f64 {
        self.error("after") / self.case.floor()
    }

    /// Whether the answer is the right one.
    pub fn is_right(&self) -> bool {
        match self.case.effect() {
            "none" => self.verdict() == "nothing-missing",
            // Listed effects may be named, but must not explain everything.
            "mixed" => !["explained", "failed"].contains(&self.verdict()),
            "unlisted" => ["unexplained", "partly-explained"].contains(&self.verdict()),
            _ => {
                let mut named = self.effects();
                named.sort_unstable();
                named == self.case.effects()
            }
        }
    }

    /// The column of the confusion matrix.
    pub fn column(&self) -> String {
        match self.effects().as_slice() {
            [] => self.verdict().to_owned(),
            _ if self.case.effects().len() > 1 => {
                let right = self.case.effects();
                let hits = self.effects().iter().filter(|e| right.contains(e)).count();
                format!("{hits} right, {} wrong", self.effects().len() - hits)
            }
            [one] => (*one).to_owned(),
            several if several.contains(&self.case.effect()) => "right one and more".to_owned(),
            _ => "several wrong".to_owned(),
        }
    }

    /// Result for a candidate: status, error over the noise, reason.
    pub fn candidate(&self, name: &str) -> String {
        let list = self.json["candidates"]
            .as_array()
            .map_or(&[][..], Vec::as_slice);
        let Some(found) = list.iter().find(|candidate| candidate["effect"] == name) else {
            return format!("`{name}` is not among the candidates");
        };
        format!(
            "`{name}` {}: held-out {}, p {}: {}",
            found["status"].as_str().unwrap_or("?"),
            found["holdout_rms"],
            found["p_value"],
            found["why"].as_str().unwrap_or("")
        )
    }
}
