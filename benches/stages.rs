//! Each stage of `compensate` by itself, named `stage/size`: parse, convert, FFT, format.
//!
//! `cargo bench --bench stages`. The peer comparison is in `benches/peer`.

use std::hint::black_box;
use std::io::Cursor;
use std::sync::Arc;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use num_complex::Complex64;
use torqcomp::io::Reading;
use torqcomp::recording::text::{ChannelRows, StampUse, TextFile};
use torqcomp_decimal::{Digits, digits};
use torqcomp_dsp::band::Band;
use torqcomp_dsp::bridge::{ArmLaw, Bridge, BridgeLayout, Supply};
use torqcomp_dsp::compensate::{BlockConvolver, InverseFilter, whole_record};
use torqcomp_dsp::conversion::Conversion;
use torqcomp_dsp::spectrum::PowerSum;

const RATE_HZ: f64 = 20_000.0;
const SIZES: [(&str, usize); 2] = [("10k", 10_000), ("1M", 1_000_000)];

fn volts(count: usize) -> Vec<f64> {
    (0..count)
        .map(|i| {
            let t = i as f64 / RATE_HZ;
            5e-4 + 1e-3 * (754.0 * t).cos() + 1e-6 * (1e7 * t).sin()
        })
        .collect()
}

fn text(count: usize) -> String {
    let rows = volts(count).into_iter().enumerate();
    rows.map(|(i, v)| format!("{:.5},{v:.9}\n", i as f64 / RATE_HZ))
        .collect()
}

fn filter() -> InverseFilter {
    let inverse = |f: f64| Complex64::new(1.0 - (f / 592.2).powi(2), 0.141 * f / 592.2);
    let band = Band::new(RATE_HZ, 2400.0).expect("a band below half the rate");
    InverseFilter::design(Arc::new(inverse), band).expect("a stand that can be inverted")
}

fn parse(c: &mut Criterion) {
    let head = Cursor::new(format!("time_s,bridge_V\n{}", text(100)));
    let file = TextFile::open("bench", Box::new(head), &Reading::default()).expect("a table");
    let plan = file.stream(0, StampUse::Placing).plan;
    let mut group = c.benchmark_group("parse");
    for (name, count) in SIZES {
        let text = text(count);
        let mut rows = ChannelRows::default();
        group.throughput(Throughput::Bytes(text.len() as u64));
        group.bench_function(name, |b| {
            b.iter(|| rows.read(black_box(text.as_bytes()), &plan))
        });
    }
    group.finish();
}

fn convert(c: &mut Criterion) {
    let law = ArmLaw::new(0.0, 157.0, 2800.0).expect("a semiconductor gage");
    let supply = Supply::ConstantVoltage { volts: 22.5 };
    let bridge =
        Bridge::new(BridgeLayout::HalfBending, law, 5784.0, supply).expect("a half bridge");
    let kinds = [
        (
            "linear",
            Conversion::linear(1667.7, 0.0).expect("a constant"),
        ),
        (
            "bridge",
            Conversion::bridge(bridge, 1.0, 0.0, 4.0e5).expect("a bridge"),
        ),
    ];
    let mut group = c.benchmark_group("convert");
    for (kind, conversion) in kinds {
        for (name, count) in SIZES {
            let volts = volts(count);
            let mut out = volts.clone();
            group.throughput(Throughput::Elements(count as u64));
            group.bench_function(format!("{kind}/{name}"), |b| {
                b.iter(|| {
                    out.copy_from_slice(&volts);
                    conversion
                        .convert_slice(black_box(&mut out))
                        .expect("volts in range");
                });
            });
        }
    }
    group.finish();
}

fn fft(c: &mut Criterion) {
    let filter = filter();
    let mut convolver = BlockConvolver::new(&filter);
    let mut power = PowerSum::new(convolver.block_length());
    let mut group = c.benchmark_group("fft");
    for (name, count) in SIZES {
        let window = volts(count + 2 * filter.half_length());
        let mut out = vec![0.0; count];
        group.throughput(Throughput::Elements(count as u64));
        group.bench_function(format!("stream/{name}"), |b| {
            b.iter(|| convolver.convolve(black_box(&window), &mut out, Some(&mut power)));
        });
        let record = &window[..count];
        group.bench_function(format!("whole-record/{name}"), |b| {
            b.iter(|| whole_record(&filter, black_box(record)).expect("finite samples"));
        });
    }
    group.finish();
}

fn format(c: &mut Criterion) {
    let mut group = c.benchmark_group("format");
    for (kind, digits) in [
        ("9", Digits::Significant(9)),
        ("12", Digits::Significant(12)),
        ("shortest", Digits::Shortest),
    ] {
        for (name, count) in SIZES {
            let torque = volts(count);
            let mut text = Vec::new();
            group.throughput(Throughput::Elements(count as u64));
            group.bench_function(format!("{kind}/{name}"), |b| {
                b.iter(|| {
                    text.clear();
                    for value in black_box(&torque) {
                        digits::write(&mut text, *value, digits);
                        text.push(b'\n');
                    }
                });
            });
        }
    }
    group.finish();
}

criterion_group! {
    name = stages;
    config = Criterion::default().sample_size(10);
    targets = parse, convert, fft, format
}
criterion_main!(stages);
