//! Trains of spikes added to a record: rate and size are properties of the stand, the moments and the shape of the
//! spikes are found in the record.

use std::ops::Range;

/// Samples in which a spike dies out, and first of them in which it changes fast.
pub(super) const LONGEST: usize = 16;
pub(super) const STEEP: usize = 4;

/// Spikes at equal intervals, independent of the input; their moments and their shape differ from record to record.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpikeTrain {
    /// Spikes per second.
    pub frequency_hz: f64,
    /// Largest magnitude of a spike in units of the record.
    pub amplitude: f64,
}

/// The moments of spikes, in samples from the first of a record.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpikeMoments {
    /// One of them.
    pub moment: f64,
    /// Samples from one to the next.
    pub period: f64,
}

impl SpikeMoments {
    /// Number of samples of a spike.
    pub(super) fn length(&self) -> usize {
        LONGEST.min((0.5 * self.period) as usize)
    }

    /// The sample's index in the spike that precedes it, and its time after the moment less that index, both in
    /// samples; `None` between spikes.
    fn place(&self, sample: usize) -> Option<(usize, f64)> {
        let after = (sample as f64 - self.moment) / self.period;
        let after = self.period * (after - after.floor());
        let index = after as usize;
        (index < self.length()).then_some((index, after - index as f64))
    }

    /// Columns whose sum with the coefficients of a [`SpikeShape`] is the train.
    #[must_use]
    pub fn columns(&self, samples: Range<usize>) -> Vec<Vec<f64>> {
        let (length, steep) = (self.length(), self.length().min(STEEP));
        let mut columns = vec![vec![0.0; samples.len()]; length + steep];
        for (row, sample) in samples.enumerate() {
            if let Some((index, part)) = self.place(sample) {
                columns[index][row] = 1.0;
                if index < steep {
                    columns[length + index][row] = part;
                }
            }
        }
        columns
    }

    /// Number of those columns.
    #[must_use]
    pub fn column_count(&self) -> usize {
        self.length() + self.length().min(STEEP)
    }

    /// The first moment after the first of some samples, and the following ones with a whole spike before the end.
    pub(super) fn within(&self, samples: &Range<usize>) -> impl Iterator<Item = f64> + use<> {
        let (moment, period) = (self.moment, self.period);
        let first = ((samples.start as f64 - moment) / period).ceil();
        let last = samples.end as f64 - self.length() as f64 - 1.0;
        let moments = (0..).map(move |k| moment + (first + f64::from(k)) * period);
        moments.take_while(move |at| *at <= last)
    }
}

/// Shape of a spike: its value at each of the samples that follow its moment, linear in the fraction of a sample
/// between.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SpikeShape {
    pub(super) level: Vec<f64>,
    pub(super) slope: Vec<f64>,
}

impl SpikeShape {
    /// The shape of the coefficients of [`SpikeMoments::columns`].
    #[must_use]
    pub fn of(coefficients: &[f64]) -> Self {
        let length = (0..coefficients.len()).find(|l| l + STEEP.min(*l) == coefficients.len());
        let (level, slope) = coefficients.split_at(length.unwrap_or(coefficients.len()));
        Self {
            level: level.to_vec(),
            slope: slope.to_vec(),
        }
    }

    pub(super) fn value(&self, index: usize, part: f64) -> f64 {
        let slope = self.slope.get(index).copied().unwrap_or(0.0);
        self.level.get(index).copied().unwrap_or(0.0) + part * slope
    }

    /// The train over some samples.
    pub fn train(&self, moments: SpikeMoments, samples: Range<usize>) -> impl Iterator<Item = f64> {
        samples.map(move |sample| {
            let place = moments.place(sample);
            place.map_or(0.0, |(index, part)| self.value(index, part))
        })
    }

    /// Largest magnitude of the spikes among some samples.
    #[must_use]
    pub fn peak(&self, moments: SpikeMoments, samples: Range<usize>) -> f64 {
        let train = self.train(moments, samples);
        train.fold(0.0, |most, value| value.abs().max(most))
    }
}
