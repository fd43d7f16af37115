//! Values on the command line.

use std::path::PathBuf;

use torqcomp_decimal::Digits;

use crate::failure::did_you_mean;
use crate::file_name::{self, ShowPath, is_dash};
use crate::io::positive_frequency;
use crate::warning::CODES;

/// Orders of a fundamental, ascending.
#[derive(Debug, Clone, PartialEq)]
pub struct Orders(pub Vec<f64>);

/// Maximum number of orders fitted at once.
const MOST_ORDERS: usize = 500;

/// The band of a compensation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum BandOption {
    /// Up to this frequency.
    Hz(f64),
    /// The band of the thesis.
    Rated,
}

pub fn band(text: &str) -> Result<BandOption, String> {
    match text.trim() {
        "rated" => Ok(BandOption::Rated),
        text => match positive_frequency(text) {
            Ok(hz) => Ok(BandOption::Hz(hz)),
            Err(why) => Err(format!("{why}; or rated for 2400 Hz")),
        },
    }
}

pub fn percent(text: &str) -> Result<f64, String> {
    match text.trim().trim_end_matches('%').trim().parse::<f64>() {
        Ok(value) if value > 0.0 && value < 50.0 => Ok(value),
        _ => Err("expected per cent between 0 and 50, such as 2".to_owned()),
    }
}

pub fn digits(text: &str) -> Result<Digits, String> {
    match text.parse::<u32>() {
        Ok(count @ 1..=15) => Ok(Digits::Significant(count)),
        _ if text == "shortest" => Ok(Digits::Shortest),
        _ => Err("expected a number from 1 to 15, or \"shortest\"".to_owned()),
    }
}

/// Two numbers in ascending order.
fn ends(text: &str) -> Option<(f64, f64)> {
    let (from, to) = text.split_once("..")?;
    let (from, to) = (from.trim().parse().ok()?, to.trim().parse().ok()?);
    (from < to).then_some((from, to))
}

pub fn time_range(text: &str) -> Result<(f64, f64), String> {
    ends(text).ok_or_else(|| "expected two times in seconds, such as 0.1..0.15".to_owned())
}

pub fn frequency_range(text: &str) -> Result<(f64, f64), String> {
    ends(text)
        .filter(|(from, to)| *from >= 0.0 && to.is_finite())
        .ok_or_else(|| {
            "expected two frequencies in Hz, the lower first, such as 20..400".to_owned()
        })
}

/// Minimum number of samples in a segment: fewer resolve no mode.
const LEAST_SEGMENT: usize = 16;

pub fn segment(text: &str) -> Result<usize, String> {
    match text.trim().parse() {
        Ok(samples) if samples >= LEAST_SEGMENT => Ok(samples),
        _ => Err(format!(
            "expected a number of samples, {LEAST_SEGMENT} or more"
        )),
    }
}

/// A file for charts, written as SVG.
pub fn svg_file(path: PathBuf) -> Result<PathBuf, String> {
    if is_dash(&path) {
        return Err("charts need the name of a file, such as chart.svg".to_owned());
    }
    match path.extension() {
        Some(end) if !end.eq_ignore_ascii_case("svg") => Err(format!(
            "charts are written as SVG only; name it {}, and convert it if necessary",
            path.with_extension("svg").shown()
        )),
        _ => Ok(path),
    }
}

/// Extensions of columnar files that polars, DuckDB and pandas read.
const COLUMNS: [&str; 3] = ["parquet", "arrow", "feather"];
/// Extensions of other formats that no verb writes.
const FOREIGN: [&str; 8] = ["xlsx", "mat", "h5", "hdf5", "npy", "tdms", "wav", "uff"];

/// A file for a result: text must not get the name of another format.
pub fn result_file(path: PathBuf) -> Result<PathBuf, String> {
    let end = path.extension().unwrap_or_default();
    let is = |other: &&&str| end.eq_ignore_ascii_case(other);
    let is_folder = file_name::ends_with_separator(&path);
    if is_folder || !COLUMNS.iter().chain(&FOREIGN).any(|other| is(&other)) {
        return Ok(path);
    }
    let as_text = path.with_extension("csv");
    let advice = match COLUMNS.iter().find(is) {
        Some(_) => format!(
            ": polars and DuckDB read it directly, and convert it: duckdb -c \"COPY (FROM '{}') TO '{}.parquet'\"",
            as_text.shown(),
            path.with_extension("").shown()
        ),
        None => String::new(),
    };
    Err(format!(
        "results are written as text or MCAP; name it {}{advice}",
        as_text.shown()
    ))
}

/// A valid warning code.
pub fn warning_code(text: &str) -> Result<String, String> {
    let mut codes = CODES
        .iter()
        .flat_map(|(_, rows)| rows.iter().map(|row| row[0]));
    match codes.clone().any(|code| code == text) {
        true => Ok(text.to_owned()),
        false => Err(format!(
            "no warning has this code{}",
            did_you_mean(text, &mut codes)
        )),
    }
}

pub fn orders(text: &str) -> Result<Orders, String> {
    let wrong = || "expected orders such as 1-20 or 0.5,1,2".to_owned();
    let mut all = Vec::new();
    for item in text.split(',') {
        match item.split_once('-') {
            Some((from, to)) => {
                let from: u32 = from.trim().parse().map_err(|_| wrong())?;
                let to: u32 = to.trim().parse().map_err(|_| wrong())?;
                if from > to || to as usize > 100_000 {
                    return Err(wrong());
                }
                all.extend((from..=to).map(f64::from));
            }
            None => all.push(item.trim().parse::<f64>().map_err(|_| wrong())?),
        }
    }
    if all.iter().any(|order| !(*order > 0.0 && order.is_finite())) {
        return Err("orders must be greater than zero; the mean is always fitted".to_owned());
    }
    all.sort_by(f64::total_cmp);
    all.dedup();
    if all.len() > MOST_ORDERS {
        return Err(format!(
            "{} orders are too many; at most {MOST_ORDERS}",
            all.len()
        ));
    }
    Ok(Orders(all))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_read_as_people_write_them() {
        assert_eq!(orders("1-3,0.5,2").unwrap().0, [0.5, 1.0, 2.0, 3.0]);
        assert!(orders("3-1").is_err() && orders("0").is_err() && orders("a").is_err());
        assert_eq!(time_range("0.1..0.2"), Ok((0.1, 0.2)));
        assert!(time_range("0.2..0.1").is_err());
        assert_eq!(frequency_range("0..20"), Ok((0.0, 20.0)));
        for wrong in ["20..5", "-1..5", "5..inf", "nan..5"] {
            assert!(
                frequency_range(wrong).unwrap_err().contains("Hz"),
                "{wrong}"
            );
        }
        assert_eq!(segment("16"), Ok(16));
        assert!(segment("15").is_err());
        assert_eq!(digits("9"), Ok(Digits::Significant(9)));
        assert_eq!(svg_file("a/x.svg".into()), Ok(PathBuf::from("a/x.svg")));
        assert!(
            svg_file("x.tar.png".into())
                .unwrap_err()
                .contains("x.tar.svg")
        );
        assert!(svg_file("-".into()).is_err());
        for good in [
            "-",
            "out.csv",
            "out.mcap",
            "out/",
            "parquet",
            "a.parquet/b.txt",
            "a.parquet/",
        ] {
            assert_eq!(result_file(good.into()), Ok(PathBuf::from(good)));
        }
        let refused = result_file("a/x.Parquet".into()).unwrap_err();
        assert!(refused.contains("name it a/x.csv: ") && refused.contains("TO 'a/x.parquet'"));
        assert_eq!(
            result_file("x.xlsx".into()),
            Err("results are written as text or MCAP; name it x.csv".to_owned())
        );
        assert!(digits("0").is_err() && digits("16").is_err());
    }
}
