//! Trains of spikes: their moments in each record, and the common period, are moved to the largest power explained.

use super::spike_search::{FoundTrain, SpikeSearch};
use super::spikes::{LONGEST, SpikeMoments};

/// Rates tried on either side, a quarter of a sample of drift apart.
const RATES: i32 = 8;
const DRIFT: f64 = 0.25;
/// Final resolution of moments and drift, in samples.
const FINEST: f64 = 1.0 / 256.0;
/// Drift from a whole period over a record, in samples, up to which that period is tried.
const MOST_DRIFT: f64 = 1.5;
/// Part of the power explained that does not matter: 1 % of the spikes.
const SLIGHT: f64 = 1e-4;
/// Power relative to the largest from which the latest moment is taken.
const AS_GOOD: f64 = 0.98;
/// Steps of a moment tried on either side.
const ASIDE: i32 = 2;
/// Power that a further coefficient of a shape must explain.
const COST: f64 = 4.0;

/// The trains of common period in records of the same rate, near a period that is known over the first of their
/// samples.
#[must_use]
pub fn find_trains(records: &[SpikeSearch], period: f64, known: usize) -> Option<Vec<FoundTrain>> {
    let longest = records.iter().map(|r| r.len()).max()?;
    let mut period = period;
    let mut count = known.min(longest);
    loop {
        let power = |period: f64| -> f64 {
            let folded = |r: &SpikeSearch| r.folded(period, 0..count.min(r.len())).1;
            records.iter().map(folded).sum()
        };
        let tried = (-RATES..=RATES)
            .map(|k| period * (1.0 + f64::from(k) * DRIFT * 2.0 / count as f64))
            .map(|period| (period, power(period)));
        period = tried.max_by(|a, b| a.1.total_cmp(&b.1))?.0;
        if count == longest {
            break;
        }
        count = (2 * count).min(longest);
    }
    let mut moments: Vec<SpikeMoments> = records.iter().map(|r| r.coarse(period)).collect();
    settle(records, &mut moments, true);
    again(records, &mut moments, true)
}

/// The trains from moments found. If the records are hardly predictable without them, they are refined once more with that
/// prediction, and with the shape that the records justify; a signal leaves the finer details of a shape open.
pub(super) fn again(
    records: &[SpikeSearch],
    moments: &mut [SpikeMoments],
    moves_period: bool,
) -> Option<Vec<FoundTrain>> {
    let first = trains(records, moments)?;
    let beside = records.iter().zip(&first);
    let beside: Option<Vec<SpikeSearch>> = beside.map(|(r, train)| r.beside_train(train)).collect();
    let Some(records) = beside else {
        return Some(first);
    };
    let mut settled = |is_smooth: bool| {
        moments.iter_mut().for_each(|m| m.is_smooth = is_smooth);
        settle(&records, moments, moves_period);
        trains(&records, moments)
    };
    let (steep, smooth) = (settled(false)?, settled(true)?);
    let worth = |trains: &[FoundTrain]| -> f64 {
        let of = |train: &FoundTrain| train.power - COST * train.moments.column_count() as f64;
        trains.iter().map(of).sum()
    };
    Some(match worth(&smooth) > worth(&steep) {
        true => smooth,
        false => steep,
    })
}

fn trains(records: &[SpikeSearch], moments: &[SpikeMoments]) -> Option<Vec<FoundTrain>> {
    let both = records.iter().zip(moments);
    both.map(|(record, m)| record.train(*m)).collect()
}

/// Moves moments in each record, and the common period, to the largest power explained.
pub(super) fn settle(records: &[SpikeSearch], moments: &mut [SpikeMoments], moves_period: bool) {
    refine(records, moments, moves_period);
    for (record, m) in records.iter().zip(moments.iter_mut()) {
        let whole = (-(LONGEST as i32)..=LONGEST as i32).map(|k| SpikeMoments {
            moment: m.moment + f64::from(k),
            ..*m
        });
        let with_power = whole.map(|moments| (moments, record.power(moments)));
        let with_power: Vec<(SpikeMoments, f64)> = with_power.collect();
        let most = with_power.iter().fold(0.0, |most, (_, p)| p.max(most));
        // The end of a spike that dies out is predictable, so that to cut it hardly costs power. A sample is left before the
        // front, for moments that are not exact yet.
        let latest = with_power.iter().rposition(|(_, p)| *p >= AS_GOOD * most);
        *m = with_power[latest.map_or(0, |place| place.saturating_sub(1))].0;
    }
    refine(records, moments, moves_period);
    if moves_period {
        make_whole(records, moments);
    }
}

/// Makes a period a whole number of samples if the spikes are as well explained by that: at whole samples, a drift of up
/// to a sample over the record changes nothing.
fn make_whole(records: &[SpikeSearch], moments: &mut [SpikeMoments]) {
    let longest = records.iter().map(|r| r.len()).max().unwrap_or(0) as f64;
    let Some(period) = moments.first().map(|m| m.period) else {
        return;
    };
    let factor = period.round() / period;
    if (factor - 1.0).abs() * longest > MOST_DRIFT {
        return;
    }
    let power = |moments: &[SpikeMoments]| -> f64 {
        let both = records.iter().zip(moments);
        both.map(|(record, m)| record.power(*m)).sum()
    };
    let mut whole = about_middles(records, moments, factor);
    refine(records, &mut whole, false);
    // Only the levels of the shape count there.
    let spared = moments.iter().map(|m| m.column_count() - m.length());
    let spared = COST * spared.sum::<usize>() as f64;
    if power(&whole) > (1.0 - SLIGHT) * power(moments) - spared {
        moments.copy_from_slice(&whole);
    }
}

/// The same by steps that are halved.
fn refine(records: &[SpikeSearch], moments: &mut [SpikeMoments], moves_period: bool) {
    let longest = records.iter().map(|r| r.len()).max().unwrap_or(0) as f64;
    let at_best = |(record, m): (&SpikeSearch, SpikeMoments), step: f64| {
        let moved = (-ASIDE..=ASIDE).map(|k| SpikeMoments {
            moment: m.moment + f64::from(k) * step,
            ..m
        });
        let with_power = moved.map(|m| (m, record.power(m)));
        let best = with_power.max_by(|a, b| a.1.total_cmp(&b.1));
        best.unwrap_or((m, 0.0))
    };
    let mut best = f64::NEG_INFINITY;
    let mut step = DRIFT;
    while step >= FINEST {
        let before = best;
        let sides = if moves_period { -1..=1 } else { 0..=0 };
        let start = moments.to_vec();
        for side in sides {
            let factor = 1.0 + 2.0 * step * f64::from(side) / longest;
            let turned = about_middles(records, &start, factor);
            let found = records.iter().zip(turned).map(|both| at_best(both, step));
            let (found, powers): (Vec<SpikeMoments>, Vec<f64>) = found.unzip();
            let power = powers.iter().sum::<f64>();
            if power > best {
                best = power;
                moments.copy_from_slice(&found);
            }
        }
        if best <= before {
            step *= 0.5;
        }
    }
}

/// The moments with another period, unchanged in the middle of each record.
fn about_middles(
    records: &[SpikeSearch],
    moments: &[SpikeMoments],
    factor: f64,
) -> Vec<SpikeMoments> {
    let turned = |(record, m): (&SpikeSearch, &SpikeMoments)| {
        let middle = 0.5 * record.len() as f64;
        let spikes = ((middle - m.moment) / m.period).round();
        let period = factor * m.period;
        SpikeMoments {
            moment: m.moment + spikes * (m.period - period),
            period,
            ..*m
        }
    };
    records.iter().zip(moments).map(turned).collect()
}
