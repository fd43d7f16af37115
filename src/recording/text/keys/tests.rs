use super::*;

const COMMA: Dialect = Dialect {
    delimiter: Delimiter::Byte(b','),
    decimal: b'.',
};

fn hz(text: &str) -> Option<f64> {
    entries(1, text, COMMA)
        .iter()
        .find_map(|entry| rate_hz(entry, None, b'.'))
}

#[test]
fn rates_and_intervals() {
    for (text, value) in [
        ("Sample rate: 1000 Hz", 1000.0),
        ("# Sample rate: 800000Hz", 8e5),
        ("Abtastrate = 2,5 kHz", 2500.0),
        ("Sampling Frequency - 5000", 5000.0),
        ("\"Sampling Frequency (Hz)=\",500000000,", 5e8),
        ("Sampling time interval(ms),0.5", 2000.0),
        ("Sample Interval,4e-07,s", 2.5e6),
        ("Delta t\t0.001", 1000.0),
        ("CH1V,CH2V,t0 =-5e-05, tInc = 1e-09,", 1e9),
        ("Sampling rate [Hz]:\t5000.000000", 5000.0),
        ("dt=20 ms", 50.0),
        ("HResolution,1.00E-05", 1e5),
        ("Sample Rate,1.00GSa/s", 1e9),
        ("XInc:,5.0E-11", 2e10),
        ("Resolution:1e-10:", 1e10),
        ("0.5 msec/sample", 2000.0),
        ("2000 samples/s", 2000.0),
        ("20 sec/sample", 0.05),
        ("Sample Rate,10,000 Hz", 1e4),
        ("Sample Rate,1,000,000.0 Hz", 1e6),
        ("Sample Rate,10,000,Hz", 1e4),
        ("Fs,10,000", 1e4),
        ("Fs,12,500 Hz", 12_500.0),
        ("Sampling Frequency [Hz],10 000", 1e4),
        ("Sample Rate,10,0 kHz", 1e4),
        ("Sample Interval,0,1 ms", 1e4),
    ] {
        let found = hz(text).expect(text);
        assert!((found / value - 1.0).abs() < 1e-12, "{text}: {found}");
    }
    for text in [
        "Max Sample Rate: 5 Hz",
        "Trigger rate,5",
        "Model,DS1052E",
        "Sample rate: auto",
    ] {
        assert_eq!(hz(text), None, "{text}");
    }
}

#[test]
fn dates() {
    let all = |lines: &[&str]| -> Vec<HeaderEntry> {
        lines
            .iter()
            .flat_map(|line| entries(1, line, COMMA))
            .collect()
    };
    assert_eq!(
        date_text(&all(&["Date,2013/02/19", "Time,09:51:39.197"])).unwrap(),
        "2013/02/19 09:51:39.197"
    );
    assert_eq!(
        date_text(&all(&["T0 = 05.05.2014 15:24:43"])).unwrap(),
        "05.05.2014 15:24:43"
    );
    assert_eq!(
        date_text(&all(&["Timestamp,2020-03-16 17:04:51"])).unwrap(),
        "2020-03-16 17:04:51"
    );
}

#[test]
fn a_comma_within_a_value_parts_nothing() {
    let dialect = Dialect {
        delimiter: Delimiter::Byte(b';'),
        decimal: b',',
    };
    let read = |text: &str| entries(7, text, dialect);
    let found = read("Aufzeichnungsdatum : 24.11.2011, 09:07:38");
    assert_eq!(found.len(), 1);
    assert_eq!(found[0].key, "Aufzeichnungsdatum");
    assert_eq!(found[0].values, ["24.11.2011, 09:07:38"]);
    assert_eq!(date_text(&found).as_deref(), Some("24.11.2011, 09:07:38"));
    let found = read("Delta              : 0,001 sec.");
    assert_eq!(found[0].key, "Delta");
    assert_eq!(rate_hz(&found[0], None, b','), Some(1000.0));
    // Separate cells, and cells of the table.
    assert_eq!(read("t0 = 5, tInc = 1e-09").len(), 2);
    assert_eq!(read("Date;24.11.2011, Thu").len(), 1);
    assert_eq!(entries(7, "Note: a,b", COMMA)[0].values, ["b"]);
}
