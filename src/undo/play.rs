//! Play in what moves the gage, taken back: `x = y ± g` while the gage is moved, and on the way from one flank to the
//! other a parabola, as a motion near its turning point is.

/// Noise, in standard deviations, that a turning point must exceed.
const TURN: f64 = 4.0;
/// Smallest turn, as a part of the play.
const SMALLEST: f64 = 1e-3;

/// A stretch over which the gage stood still while the play was gone through.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Turn {
    /// First and last sample at rest.
    from: usize,
    to: usize,
    /// Direction before it: 1 or −1.
    before: f64,
    /// Where the gage stood.
    at: f64,
}

/// Takes play of half-width `gap` back; the samples at which the gage stood still.
pub fn invert(samples: &mut [f64], gap: f64, noise_std: f64) -> Vec<usize> {
    let width = (TURN * noise_std).max(SMALLEST * gap);
    let turns = turns(samples, width);
    let mut bridged = Vec::new();
    let Some(first) = turns.first() else {
        return bridged;
    };
    let mut direction = first.before;
    let mut next = turns.iter().peekable();
    for (i, sample) in samples.iter_mut().enumerate() {
        while next.peek().is_some_and(|turn| i > turn.to) {
            direction = -next.next().map_or(direction, |turn| turn.before);
        }
        match next.peek() {
            Some(turn) if i >= turn.from => {
                let part = (i - turn.from) as f64 / (turn.to - turn.from).max(1) as f64;
                *sample = turn.at + turn.before * gap * (1.0 - 2.0 * part * part);
                bridged.push(i);
            }
            _ => *sample += direction * gap,
        }
    }
    bridged
}

/// Turning points of a signal that exceed a width.
fn turns(samples: &[f64], width: f64) -> Vec<Turn> {
    let mut turns = Vec::new();
    let mut direction = 0.0;
    let (mut high, mut low) = (0, 0);
    for (i, y) in samples.iter().enumerate() {
        if *y > samples[high] {
            high = i;
        }
        if *y < samples[low] {
            low = i;
        }
        let turned = if direction >= 0.0 && samples[high] - y > width {
            Some((1.0, high))
        } else if direction <= 0.0 && y - samples[low] > width {
            Some((-1.0, low))
        } else {
            None
        };
        if let Some((before, extreme)) = turned {
            turns.push(rest(samples, before, extreme, width));
            direction = -before;
            (high, low) = (i, i);
        }
    }
    turns
}

/// How long a signal stood still around an extreme: within the width of it.
fn rest(samples: &[f64], before: f64, extreme: usize, width: f64) -> Turn {
    let end = samples[extreme];
    let still = |i: &usize| (end - samples[*i]) * before <= width;
    let from = (0..=extreme)
        .rev()
        .take_while(still)
        .last()
        .unwrap_or(extreme);
    let to = (extreme..samples.len())
        .take_while(still)
        .last()
        .unwrap_or(extreme);
    // In noise the extreme is the largest of many; the gage stood where most of them are.
    let at = samples[from..=to].iter().sum::<f64>() / (to + 1 - from) as f64;
    Turn {
        from,
        to,
        before,
        at,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sine_comes_back_through_play() {
        let gap = 0.2;
        let clean: Vec<f64> = (0..4000).map(|i| (f64::from(i) * 0.01).sin()).collect();
        let mut follower = 0.0_f64;
        let mut samples: Vec<f64> = clean
            .iter()
            .map(|x| {
                follower = follower.clamp(x - gap, x + gap);
                follower
            })
            .collect();
        let _ = invert(&mut samples, gap, 0.0);
        let worst = |range: std::ops::Range<usize>| {
            range
                .map(|i| (samples[i] - clean[i]).abs())
                .fold(0.0, f64::max)
        };
        assert!(worst(200..3900) < 0.02, "{}", worst(200..3900));
    }
}
