//! Trains of spikes added to a record: rate and size are properties of the stand, the moments and the shape of the
//! spikes are found in the record.

use std::ops::Range;

/// Samples in which a spike dies out.
pub(super) const LONGEST: usize = 16;
/// Distance in samples at which a moment coincides with a sample, whatever the rounding.
pub(super) const SAME: f64 = 1e-6;
/// Largest number of coefficients of a spike between two samples: of a parabola over the fraction of a sample.
pub(super) const TERMS: usize = 3;

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
    /// Whether the spikes are parabolas between samples. One with a steep front needs only straight lines, and less noise
    /// enters its shape.
    pub is_smooth: bool,
}

impl SpikeMoments {
    /// Number of samples of a spike.
    pub(super) fn length(&self) -> usize {
        LONGEST.min((0.5 * self.period) as usize)
    }

    /// The sample's index in the spike that precedes it, and the powers of its time after the moment; `None` between
    /// spikes.
    fn place(&self, sample: usize) -> Option<(usize, [f64; TERMS])> {
        let spikes = (sample as f64 - self.moment + SAME) / self.period;
        let after = (sample as f64 - self.moment - self.period * spikes.floor()).max(0.0);
        let index = (after + SAME) as usize;
        (index < self.length()).then(|| (index, powers((after - index as f64).max(0.0))))
    }

    /// Number of coefficients at each sample of a spike.
    fn terms(&self) -> usize {
        if self.is_smooth { TERMS } else { TERMS - 1 }
    }

    /// Sample and power of each coefficient.
    pub(super) fn coefficients(&self) -> impl Iterator<Item = (usize, usize)> + use<> {
        let terms = self.terms();
        (0..self.length()).flat_map(move |index| (0..terms).map(move |term| (index, term)))
    }

    /// Columns whose sum with the coefficients of a [`SpikeShape`] is the train.
    #[must_use]
    pub fn columns(&self, samples: Range<usize>) -> Vec<Vec<f64>> {
        let mut columns = vec![vec![0.0; samples.len()]; self.column_count()];
        for (row, sample) in samples.enumerate() {
            let Some((index, powers)) = self.place(sample) else {
                continue;
            };
            let own = columns[self.terms() * index..].iter_mut();
            let own = own.take(self.terms());
            own.zip(powers).for_each(|(c, p)| c[row] = p);
        }
        columns
    }

    /// Number of those columns.
    #[must_use]
    pub fn column_count(&self) -> usize {
        self.terms() * self.length()
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

/// Powers of the fraction of a sample between the moment and the next sample, about its middle.
pub(super) fn powers(part: f64) -> [f64; TERMS] {
    let middle = part - 0.5;
    [1.0, middle, middle * middle]
}

/// Shape of a spike: its value at each of the samples that follow its moment, as a parabola over the fraction of a
/// sample between.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SpikeShape {
    /// Coefficients for each sample.
    pub(super) samples: Vec<[f64; TERMS]>,
}

impl SpikeShape {
    /// The shape of the coefficients of [`SpikeMoments::columns`].
    #[must_use]
    pub fn of(moments: SpikeMoments, coefficients: &[f64]) -> Self {
        let mut samples = vec![[0.0; TERMS]; moments.length()];
        for ((index, term), value) in moments.coefficients().zip(coefficients) {
            samples[index][term] = *value;
        }
        Self { samples }
    }

    pub(super) fn value(&self, index: usize, powers: [f64; TERMS]) -> f64 {
        let own = self.samples.get(index).into_iter().flatten();
        own.zip(powers).map(|(c, p)| c * p).sum()
    }

    /// The train over some samples.
    pub fn train(
        &self,
        moments: SpikeMoments,
        samples: Range<usize>,
    ) -> impl ExactSizeIterator<Item = f64> {
        samples.map(move |sample| {
            let place = moments.place(sample);
            place.map_or(0.0, |(index, powers)| self.value(index, powers))
        })
    }

    /// Largest magnitude of the spikes among some samples.
    #[must_use]
    pub fn peak(&self, moments: SpikeMoments, samples: Range<usize>) -> f64 {
        let train = self.train(moments, samples);
        train.fold(0.0, |most, value| value.abs().max(most))
    }
}
