//! Windowed inversion of long records: the linear links of a chain use a margin around each window, and the memory of
//! the stand's torques continues from one window to the next.

use std::ops::Range;

use torqcomp_model::effects::Action;

use super::motion::{BLOCK, Beside, Carried};
use super::{ChainInverse, InverseResult};
use crate::failure::Failure;

/// Number of samples that a window adds to the result.
const OWN: usize = 8 * BLOCK;

/// A part of a record that is inverted separately.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct RecordWindow {
    /// Samples used.
    pub seen: Range<usize>,
    /// Samples of the result.
    pub own: Range<usize>,
}

impl RecordWindow {
    /// Windows for `count` samples: one, unless there is a margin beyond which the ends have no effect.
    fn all(count: usize, margin: Option<usize>, own: usize) -> Vec<Self> {
        let mut all: Vec<Self> = Vec::new();
        let Some(margin) = margin else {
            return vec![Self {
                seen: 0..count,
                own: 0..count,
            }];
        };
        loop {
            let start = all.last().map_or(0, |window| window.own.end);
            // The remainder for another window must be longer than a margin.
            let is_last = count - start <= own + margin;
            let end = if is_last { count } else { start + own };
            all.push(Self {
                seen: start.saturating_sub(margin)..count.min(end + margin),
                own: start..end,
            });
            if is_last {
                return all;
            }
        }
    }

    /// The own samples relative to those used.
    pub(crate) fn inner(&self) -> Range<usize> {
        self.own.start - self.seen.start..self.own.end - self.seen.start
    }
}

impl ChainInverse {
    /// Number of samples on both sides of a window beyond which nothing affects it; `None` if the record has to be
    /// inverted as a whole: for lines, spikes and trends that are fitted to all of it, for effects that depend on time
    /// or have their own memory, for a coupling past the stand, and for links whose inverse does not decay.
    pub(crate) fn margin(&self) -> Option<usize> {
        let stand = &self.chain.stand;
        let is_local = self.links().iter().all(|link| match &link.action {
            Action::Lines(_) | Action::Spikes(_) | Action::Course(_) | Action::Feedthrough(_) => {
                false
            }
            Action::Distortion(distortion) => distortion.is_pointwise(),
            _ => link.dies_out(stand) && !link.blocks_constants(stand),
        });
        Some(self.lead()).filter(|lead| is_local && *lead <= OWN)
    }

    /// The windows in which a record of `count` samples is inverted.
    pub(crate) fn windows(&self, count: usize) -> Vec<RecordWindow> {
        RecordWindow::all(count, self.margin(), OWN)
    }

    /// Inverts a window of a record, replacing the state from the previous window by that for the next one. The result
    /// covers the window's own samples, indexed from the first of the record.
    ///
    /// # Errors
    /// Those of [`ChainInverse::run`].
    pub(crate) fn window(
        &self,
        seen: &[f64],
        window: &RecordWindow,
        (rate_hz, noise_std): (f64, f64),
        carried: &mut Option<Carried>,
    ) -> Result<InverseResult, Failure> {
        let own = window.inner();
        // The next window starts as far before the end of this one's own part as this one extends beyond it.
        let margin = window.seen.end - window.own.end;
        let beside = Beside {
            before: carried.take(),
            end: (margin > 0).then_some((own.end, margin)),
        };
        let mut result = self.beside(seen, rate_hz, noise_std, beside)?;
        *carried = result.next.take();
        result.applied.truncate(own.end);
        result.applied.drain(..own.start);
        for (_, lost) in &mut result.lost {
            lost.samples.retain(|place| own.contains(place));
            let places = lost.samples.iter_mut();
            places.for_each(|place| *place += window.seen.start);
        }
        result.lost.retain(|(_, lost)| !lost.samples.is_empty());
        Ok(result)
    }
}

impl InverseResult {
    /// Merges the results of a further window except its samples; `part` is its fraction of the record.
    pub(crate) fn join(&mut self, further: Self, part: f64) {
        for (effect, lost) in further.lost {
            match self.lost.iter_mut().find(|(known, _)| *known == effect) {
                Some((_, all)) => all.samples.extend(lost.samples),
                None => self.lost.push((effect, lost)),
            }
        }
        self.lines.extend(further.lines);
        let at_rest = further.at_rest.map(|rest| rest.times(part));
        self.at_rest = at_rest.map(|rest| rest.plus(self.at_rest.unwrap_or_default()));
        self.seen_to_hz = further.seen_to_hz;
    }
}

#[cfg(test)]
mod tests {
    use torqcomp_dsp::band::Band;

    use super::*;
    use crate::stand;

    /// Inversion in windows equals that of the whole record, for torques with memory and without.
    #[test]
    fn windows_are_as_good_as_the_whole() {
        let effects = [
            "kind = \"cubic-stiffness\"\nform = \"beside\"\ncoefficient = \"1e-5 N m/(N m)^3\"",
            "kind = \"coulomb-friction\"\nform = \"sharp\"\ntorque = \"5 N m\"",
            "kind = \"bouc-wen-hysteresis\"\nform = \"shown\"\nstiffness_ratio = 0.5\nloss = \"0.01 1/(N m)\"\nshape = \"0.005 1/(N m)\"",
        ];
        let wave = |i: usize| {
            let t = i as f64 / 20_000.0;
            100.0 * (300.0 * t).sin()
                + 40.0 * (2100.0 * t + (3.0 * t).sin()).cos()
                + 30.0 * (7.0 * t).sin()
        };
        let record: Vec<f64> = (0..100_000).map(wave).collect();
        for effect in effects {
            let text = format!(
                "schema = \"torqcomp.stand/1\"\nname = \"test\"\n[mechanics]\ninertia = \"5.85e-3 slug ft^2\"\n\
                 damping = \"3.07 ft lbf s/rad\"\nstiffness = \"8.1e4 ft lbf/rad\"\n[calibration]\n\
                 torque_per_volt = \"1.23e3 ft lbf/V\"\n[[effects]]\n{effect}\n"
            );
            let stand = stand::parse("test", &text).unwrap();
            let inverse = ChainInverse::new(&stand, Band::new(20_000.0, 1500.0).unwrap()).unwrap();
            let margin = inverse.margin();
            assert!(margin.is_some(), "{effect}");
            let whole = inverse.run(&record, 20_000.0, 1e-3).unwrap();
            let windows = RecordWindow::all(record.len(), margin, 2 * BLOCK);
            assert_eq!(windows.len(), 3);
            let (mut joined, mut carried, mut all) = (InverseResult::default(), None, Vec::new());
            for window in &windows {
                let seen = &record[window.seen.clone()];
                let mut found = inverse
                    .window(seen, window, (20_000.0, 1e-3), &mut carried)
                    .unwrap();
                all.append(&mut found.applied);
                joined.join(found, window.own.len() as f64 / record.len() as f64);
            }
            assert_eq!(all.len(), record.len());
            let off = all.iter().zip(&whole.applied).map(|(a, b)| (a - b).abs());
            let largest = off.fold(0.0, f64::max);
            // The largest torque is above 100 N m.
            assert!(largest < 1e-3, "{effect}: {largest}");
            assert_eq!(joined.seen_to_hz, whole.seen_to_hz);
            let part = |result: &InverseResult| result.at_rest.unwrap_or_default().part;
            let apart = part(&joined) - part(&whole);
            assert!(apart.abs() < 1e-4, "{effect}: {apart}");
        }
    }

    #[test]
    fn windows_meet_and_the_last_one_is_no_shorter_than_a_margin() {
        let all = RecordWindow::all(250, Some(20), 100);
        let own: Vec<Range<usize>> = all.iter().map(|window| window.own.clone()).collect();
        assert_eq!(own, [0..100, 100..200, 200..250]);
        assert_eq!((all[1].seen.clone(), all[1].inner()), (80..220, 20..120));
        assert_eq!(RecordWindow::all(120, Some(20), 100).len(), 1);
        assert_eq!(RecordWindow::all(1000, None, 100)[0].seen, 0..1000);
    }
}
