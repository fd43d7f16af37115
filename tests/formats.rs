//! WAV, universal files and MATLAB 5, written here by code independent of the readers: numbers, units, rates and times
//! survive every command, and damage or missing data are reported.

use serde_json::Value;

use crate::util::{Folder, column, steady, table};

const RATE: u32 = 20_000;

/// A signal of values that are exact in 16 bits.
fn signal(count: usize) -> Vec<f64> {
    let value = |i: usize| (20_000.0 * (0.01 * i as f64).sin()).round() / 32_768.0;
    (0..count).map(value).collect()
}

/// Sample storage of a WAV file: format, bits, and the bytes of a fraction of full scale.
type Stored = (u16, u16, fn(f64) -> Vec<u8>);

const STORED: [Stored; 6] = [
    (1, 8, |v| vec![(v * 128.0 + 128.0).round() as u8]),
    (1, 16, |v| {
        ((v * 32_768.0).round() as i16).to_le_bytes().to_vec()
    }),
    (1, 24, |v| {
        ((v * 8_388_608.0) as i32).to_le_bytes()[..3].to_vec()
    }),
    (1, 32, |v| {
        ((v * 2_147_483_648.0) as i32).to_le_bytes().to_vec()
    }),
    (3, 32, |v| (v as f32).to_le_bytes().to_vec()),
    (3, 64, |v| v.to_le_bytes().to_vec()),
];

/// A WAV file of channels, with a chunk of odd length before the data.
fn wav((format, bits, bytes): Stored, channels: &[Vec<f64>], is_extensible: bool) -> Vec<u8> {
    let block = channels.len() as u16 * bits / 8;
    let mut head = Vec::new();
    head.extend((if is_extensible { 0xfffe } else { format }).to_le_bytes());
    head.extend((channels.len() as u16).to_le_bytes());
    head.extend(RATE.to_le_bytes());
    head.extend((RATE * u32::from(block)).to_le_bytes());
    head.extend(block.to_le_bytes());
    head.extend(bits.to_le_bytes());
    if is_extensible {
        head.extend(22_u16.to_le_bytes());
        head.extend(bits.to_le_bytes());
        head.extend(0_u32.to_le_bytes());
        head.extend(format.to_le_bytes());
        head.extend(b"\x00\x00\x00\x00\x10\x00\x80\x00\x00\xaa\x00\x38\x9b\x71");
    }
    let mut data = Vec::new();
    for i in 0..channels[0].len() {
        channels
            .iter()
            .for_each(|channel| data.extend(bytes(channel[i])));
    }
    let mut file = b"RIFF\0\0\0\0WAVE".to_vec();
    let mut chunk = |id: &[u8], content: &[u8]| {
        file.extend(id);
        file.extend((content.len() as u32).to_le_bytes());
        file.extend(content);
        file.resize(file.len() + content.len() % 2, 0);
    };
    chunk(b"LIST", b"INFOISFT\x03\0\0\0abc");
    chunk(b"fmt ", &head);
    chunk(b"data", &data);
    file
}

#[test]
fn samples_of_wav_are_what_full_scale_makes_of_them() {
    let folder = Folder::new();
    let channels = [signal(500), signal(500).iter().map(|v| -0.5 * v).collect()];
    for stored in STORED {
        for is_extensible in [false, true] {
            folder.write("a.wav", wav(stored, &channels, is_extensible));
            let words = ["extract", "a.wav", "--full-scale", "5 V", "--channel", "2"];
            let ran = folder.run(&words);
            assert_eq!(ran.code, 0, "{stored:?}: {}", ran.stderr);
            let (head, rows) = table(&ran.stdout);
            assert_eq!(head, ["time_s", "channel 2 [V]"]);
            assert_eq!(rows.len(), 500);
            // Half a step of the coarsest.
            let bound = match stored.1 {
                bits @ (8 | 16) => 5.0 / 2.0_f64.powi(i32::from(bits)),
                _ => 1e-6,
            };
            for (i, row) in rows.iter().enumerate() {
                assert!((row[0] - i as f64 / f64::from(RATE)).abs() < 1e-12);
                assert!(
                    (row[1] - 5.0 * channels[1][i]).abs() <= bound,
                    "{stored:?} {i}"
                );
            }
        }
    }
}

#[test]
fn fractions_of_full_scale_are_no_volts() {
    let folder = Folder::new();
    let (shown, _) = steady(&[(500.0, 60.0, 0.0)], f64::from(RATE), 20_000);
    let volts: Vec<f64> = shown
        .iter()
        .map(|torque| torque / (1.23e3 * 1.355_817_948_331_400_4))
        .collect();
    let full: Vec<f64> = volts.iter().map(|v| v / 10.0).collect();
    folder.write("in.wav", wav(STORED[5], &[full], false));
    let compensate = [
        "compensate",
        "in.wav",
        "--stand",
        "stand.toml",
        "-o",
        "out.csv",
        "--band",
        "800",
    ];
    folder.run(&compensate).says(1, &["of full scale"]);
    let with_unit = [&compensate[..], &["--unit", "V"]].concat();
    folder
        .run(&with_unit)
        .says(2, &["fractions of full scale", "--full-scale \"10 V\""]);
    let told = folder.json(&["inspect", "in.wav", "--json"]);
    let codes: Vec<&Value> = told["warnings"]
        .as_array()
        .unwrap()
        .iter()
        .map(|w| &w["code"])
        .collect();
    assert!(codes.contains(&&"full-scale-unknown".into()), "{told}");
    let ran = folder.run(&[&compensate[..], &["--full-scale", "10 V", "-q"]].concat());
    assert_eq!(ran.code, 0, "{}", ran.stderr);
    let torque = column(&folder.read("out.csv"), "compensated_torque_n_m");
    // The torque of the stand at 60 Hz, away from the ends.
    let (gain, _) = crate::util::hertel_response(60.0);
    let largest = torque[5000..15_000]
        .iter()
        .fold(0.0_f64, |a, v| a.max(v.abs()));
    assert!(
        (largest / 500.0 - 1.0).abs() < 1e-3,
        "{largest} beside a gain of {gain}"
    );
    folder.write("in.csv", "time_s,a_V\n0,1\n0.1,2\n0.2,3\n");
    folder
        .run(&["extract", "in.csv", "--full-scale", "10 V"])
        .says(2, &["--full-scale does not apply"]);
    folder
        .run(&["extract", "in.wav", "--delimiter", ";"])
        .says(2, &["--delimiter does not apply: the input is a WAV file"]);
}

#[test]
fn a_wav_file_that_ends_early_loses_what_is_not_there() {
    let folder = Folder::new();
    let whole = wav(STORED[1], &[signal(500)], false);
    folder.write("a.wav", &whole[..whole.len() - 201]);
    let ran = folder.run(&["extract", "a.wav", "--full-scale", "1 V"]);
    ran.says(3, &["file-cut", "399 of 500 samples"]);
    assert_eq!(table(&ran.stdout).1.len(), 399);
    // A recorder that was switched off has written no length.
    let data = whole.windows(4).position(|w| w == b"data").unwrap();
    let mut open = whole.clone();
    open[data + 4..data + 8].fill(0xff);
    folder.write("a.wav", &open);
    let ran = folder.run(&["extract", "a.wav", "--full-scale", "1 V"]);
    assert_eq!((ran.code, table(&ran.stdout).1.len()), (0, 500));
    for cut in [13, 20, 40] {
        folder.write("a.wav", &whole[..cut]);
        folder.run(&["extract", "a.wav"]).says(1, &["a.wav"]);
    }
}

/// A data set 58: kind of number, whether the abscissa is uniform, byte order or text.
fn data_set(kind: u8, is_even: bool, order: Option<bool>, samples: &[f64]) -> Vec<u8> {
    let step = 1.0 / 44_100.0;
    let mut head = String::from("bridge\n\n\n\n\n");
    head += "    1         0    0         0       NONE         0   0       NONE         0   0\n";
    let spacing = u8::from(is_even);
    head += &format!(
        "{kind:10}{:10}{spacing:10}{:>13}{:>13}{:>13}\n",
        samples.len(),
        e(0.5, 5),
        e(step, 5),
        e(0.0, 5)
    );
    head += "        17    0    0    0 Time                 s                   \n";
    head += "         0    0    0    0 Bridge               mV                  \n";
    head += "         0    0    0    0 NONE                 NONE                \n";
    head += "         0    0    0    0 NONE                 NONE                \n";
    let mut numbers = Vec::new();
    for (i, sample) in samples.iter().enumerate() {
        if !is_even {
            numbers.push(0.5 + i as f64 * 1e-3);
        }
        numbers.push(*sample);
    }
    let mut set = b"    -1\n".to_vec();
    let Some(is_little) = order else {
        set.extend(format!("{:>6}\n{head}", 58).bytes());
        let (width, digits, a_line) = if kind == 2 { (13, 5, 6) } else { (20, 11, 4) };
        for line in numbers.chunks(a_line) {
            // Without spaces between them if a sign fills the field.
            let cells = line.iter().enumerate();
            let cells = cells.map(|(i, v)| match kind == 4 && !is_even && i % 2 == 0 {
                true => format!("{:>13}", e(*v, 5)),
                false => format!("{:>width$}", e(*v, digits)),
            });
            set.extend(cells.collect::<String>().bytes().chain([b'\n']));
        }
        set.extend(b"    -1\n");
        return set;
    };
    let mut bytes = Vec::new();
    for number in &numbers {
        let mut stored = match kind {
            2 => (*number as f32).to_le_bytes().to_vec(),
            _ => number.to_le_bytes().to_vec(),
        };
        if !is_little {
            stored.reverse();
        }
        bytes.extend(stored);
    }
    let order = if is_little { 1 } else { 2 };
    set.extend(
        format!(
            "{:>6}b{order:6}{:6}{:12}{:12}{:6}{:6}{:12}{:12}\n{head}",
            58,
            2,
            11,
            bytes.len(),
            0,
            0,
            0,
            0
        )
        .bytes(),
    );
    set.extend(bytes);
    set.extend(b"    -1\n");
    set
}

/// A number in FORTRAN format `E` with this many digits after the point.
fn e(value: f64, digits: usize) -> String {
    let text = format!("{value:.digits$E}");
    let (mantissa, power) = text.split_once('E').unwrap();
    let power: i32 = power.parse().unwrap();
    format!(
        "{mantissa}E{}{:02}",
        if power < 0 { '-' } else { '+' },
        power.abs()
    )
}

/// Functions with one name are told apart by the labels of their ordinates.
#[test]
fn functions_of_one_name_have_their_labels() {
    let folder = Folder::new();
    let samples: Vec<f64> = (0..30).map(f64::from).collect();
    let labelled = |label: &str| {
        let set = String::from_utf8(data_set(4, true, None, &samples)).unwrap();
        let lines = set.lines().enumerate().map(|(k, line)| match k {
            // The ordinate's line, behind those of the data set, its name and its numbers.
            10 => format!("{}{label:<20}{}\n", &line[..26], &line[46..]),
            _ => format!("{line}\n"),
        });
        lines.collect::<String>()
    };
    folder.write("a.uff", labelled("force") + &labelled("torque"));
    let ran = folder.run(&["extract", "a.uff", "--channel", "torque"]);
    assert_eq!(
        table(&ran.stdout).0[1],
        "bridge torque [mV]",
        "{}",
        ran.stderr
    );
    folder.write("a.uff", labelled("torque"));
    let ran = folder.run(&["extract", "a.uff"]);
    assert_eq!(table(&ran.stdout).0[1], "bridge [mV]", "{}", ran.stderr);
}

#[test]
fn functions_of_universal_files_are_channels() {
    let folder = Folder::new();
    let samples: Vec<f64> = (0..30).map(|i| (i as f64 - 15.0) * 0.125).collect();
    for kind in [2, 4] {
        for is_even in [true, false] {
            for order in [None, Some(true), Some(false)] {
                let mut file = data_set(kind, is_even, order, &samples);
                // Units of the file, which are not a function, and a second function.
                file.extend(b"    -1\n   164\n         1SI: Meter (newton)         2\n    -1\n");
                file.extend(data_set(kind, is_even, order, &samples[..20]));
                folder.write("a.dat", &file);
                let ran = folder.run(&["extract", "a.dat", "--channel", "1"]);
                let case = format!("{kind} {is_even} {order:?}");
                assert_eq!(ran.code, 0, "{case}: {}", ran.stderr);
                let (head, rows) = table(&ran.stdout);
                assert_eq!(head, ["time_s", "bridge [mV]"]);
                let values: Vec<f64> = rows.iter().map(|row| row[1]).collect();
                assert_eq!(values, samples, "{case}");
                // The step has six digits, and is that of 44100 Hz.
                let step = if is_even { 1.0 / 44_100.0 } else { 1e-3 };
                for (i, row) in rows.iter().enumerate() {
                    assert!(
                        (row[0] - 0.5 - i as f64 * step).abs() < 1e-6 * step * 30.0,
                        "{case} {i}: {}",
                        row[0]
                    );
                }
                let second = folder.run(&["extract", "a.dat", "--channel", "2"]);
                assert_eq!(
                    table(&second.stdout).1.len(),
                    20,
                    "{case}: {}",
                    second.stderr
                );
            }
        }
    }
}

#[test]
fn a_universal_file_that_ends_early_loses_samples() {
    let folder = Folder::new();
    let samples = vec![1.5; 30];
    for order in [None, Some(true)] {
        let file = data_set(4, true, order, &samples);
        folder.write("a.uff", &file[..file.len() - 60]);
        let ran = folder.run(&["extract", "a.uff"]);
        ran.says(3, &["file-cut", "\"bridge\" has 2", "of 30 samples"]);
    }
    folder.write(
        "a.uff",
        "    -1\n    58b     1     1          11         100     0     0\n",
    );
    folder.run(&["extract", "a.uff"]).says(1, &["IEEE 754"]);
}

/// An element of a MATLAB file, padded to eight bytes.
fn element(kind: u32, content: &[u8], is_little: bool) -> Vec<u8> {
    let mut bytes: Vec<u8> = [kind, content.len() as u32]
        .iter()
        .flat_map(|word| word_of(*word, is_little))
        .collect();
    bytes.extend(content);
    bytes.resize(bytes.len().next_multiple_of(8), 0);
    bytes
}

fn word_of(word: u32, is_little: bool) -> [u8; 4] {
    if is_little {
        word.to_le_bytes()
    } else {
        word.to_be_bytes()
    }
}

/// A variable of doubles, of a class and with dimensions.
fn variable(
    name: &str,
    class: u32,
    dimensions: [u32; 2],
    values: &[f64],
    is_little: bool,
) -> Vec<u8> {
    let words = |words: [u32; 2]| -> Vec<u8> {
        words
            .iter()
            .flat_map(|word| word_of(*word, is_little))
            .collect()
    };
    let doubles = values.iter().flat_map(|v| {
        if is_little {
            v.to_le_bytes()
        } else {
            v.to_be_bytes()
        }
    });
    let content = [
        element(6, &words([class, 0]), is_little),
        element(5, &words(dimensions), is_little),
        element(1, name.as_bytes(), is_little),
        element(9, &doubles.collect::<Vec<u8>>(), is_little),
    ];
    element(14, &content.concat(), is_little)
}

fn matlab(variables: &[Vec<u8>], is_little: bool) -> Vec<u8> {
    let mut file = format!("{:<124}", "MATLAB 5.0 MAT-file, Platform: none").into_bytes();
    file.extend(if is_little {
        b"\x00\x01IM"
    } else {
        b"\x01\x00MI"
    });
    file.extend(variables.concat());
    file
}

#[test]
fn vectors_of_matlab_are_channels_on_their_time() {
    let folder = Folder::new();
    let values = signal(64);
    let millis: Vec<f64> = (0..64).map(|i| 100.0 + 0.5 * i as f64).collect();
    for is_little in [true, false] {
        let of = |name: &str, values: &[f64]| {
            variable(name, 6, [values.len() as u32, 1], values, is_little)
        };
        let text = variable("note", 4, [1, 3], &[97.0, 98.0, 99.0], is_little);
        let matrix = variable("m", 6, [2, 2], &[1.0, 2.0, 3.0, 4.0], is_little);
        folder.write(
            "a.mat",
            matlab(
                &[
                    of("time_ms", &millis),
                    of("bridge_mV", &values),
                    text,
                    matrix,
                ],
                is_little,
            ),
        );
        let ran = folder.run(&["extract", "a.mat"]);
        assert_eq!(ran.code, 0, "{}", ran.stderr);
        let (head, rows) = table(&ran.stdout);
        assert_eq!(head, ["time_s", "bridge_mV [mV]"]);
        for (i, row) in rows.iter().enumerate() {
            assert_eq!(row[1], values[i]);
            assert!((row[0] - 1e-3 * millis[i]).abs() < 1e-12);
        }
        assert!(
            ran.stderr.contains("\"note\" (text), \"m\" (a matrix)"),
            "{}",
            ran.stderr
        );
        // A rate instead of a time vector; without either, it is asked for.
        folder.write(
            "a.mat",
            matlab(&[of("Fs", &[2000.0]), of("x", &values)], is_little),
        );
        let report = folder.json(&["inspect", "a.mat", "--json"]);
        assert_eq!(report["channels"][0]["rate_hz"], 2000.0);
        folder.write("a.mat", matlab(&[of("x", &values)], is_little));
        folder.run(&["extract", "a.mat"]).says(1, &["--rate"]);
        folder.write(
            "a.mat",
            matlab(
                &[of("Fs", &[2000.0]), of("dt", &[1e-3]), of("x", &values)],
                is_little,
            ),
        );
        folder
            .run(&["extract", "a.mat"])
            .says(1, &["two rates, 2000 and 1000 Hz"]);
        let ran = folder.run(&["extract", "a.mat", "--rate", "1000"]);
        assert_eq!(ran.code, 0, "{}", ran.stderr);
    }
    let whole = matlab(
        &[
            variable("Fs", 6, [1, 1], &[8.0], true),
            variable("x", 6, [64, 1], &values, true),
            variable("y", 6, [64, 1], &values, true),
        ],
        true,
    );
    folder.write("a.mat", &whole[..whole.len() - 20]);
    folder.run(&["extract", "a.mat"]).says(3, &["file-cut"]);
}

#[test]
fn a_sample_that_is_no_number_has_a_place() {
    let folder = Folder::new();
    let mut values = signal(50);
    values[7] = f64::NAN;
    folder.write("a.wav", wav(STORED[5], &[values], false));
    let words = [
        "compensate",
        "a.wav",
        "--stand",
        "stand.toml",
        "--full-scale",
        "1 V",
    ];
    folder.run(&words).says(
        1,
        &["a.wav, sample 8: the value of \"channel 1\" is not a finite number"],
    );
}

#[test]
fn files_of_other_programs_are_refused_with_the_way_to_convert_them() {
    let folder = Folder::new();
    folder.write("bag.db3", [&b"SQLite format 3\0"[..], &[0; 100]].concat());
    folder
        .run(&["inspect", "bag.db3"])
        .says(1, &["mcap convert", "ros2 bag convert"]);
    let mut newer = matlab(&[], true);
    newer[124..126].copy_from_slice(b"\0\x02");
    folder.write("new.mat", &newer);
    folder.run(&["inspect", "new.mat"]).says(1, &["-v7"]);
    folder.write("a.h5", b"\x89HDF\r\n\x1a\n");
    folder.run(&["inspect", "a.h5"]).says(1, &["HDF5"]);
    // In a folder, they are left out, but recordings of these formats are not.
    std::fs::create_dir(folder.path("logs")).unwrap();
    folder.write(
        "logs/bag.db3",
        [&b"SQLite format 3\0"[..], &[0; 100]].concat(),
    );
    folder.write("logs/a.wav", wav(STORED[1], &[signal(500)], false));
    folder.write("logs/b.uff", data_set(4, true, None, &signal(50)));
    folder
        .run(&["inspect", "logs", "-o", "out/"])
        .says(0, &["2 done", "judging by their content: logs/bag.db3"]);
}
