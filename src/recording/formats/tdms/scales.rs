//! Scales of TDMS channels (`NI_Scale[n]_…`): the meaning of the stored numbers, which DAQmx and LabVIEW leave to the
//! reader.
//!
//! Equations of the bridges: NI, Strain Gauge Configuration Types; of resistance thermometers: Callendar and Van Dusen
//! (IEC 60751); of thermistors: Steinhart and Hart.

use super::objects::{Properties, Property, RAW, RawSeries};

/// Codes of DAQmx.
const BY_CURRENT: f64 = 10_134.0;
const BY_VOLTAGE: f64 = 10_322.0;

/// Input of a scale.
#[derive(Debug, Clone, Copy, PartialEq)]
enum ScaleSource {
    Stored,
    Scale(usize),
}

#[derive(Debug, PartialEq)]
enum ChannelScale {
    /// Result not used.
    Unused,
    /// The values of a DAQmx scaler.
    Scaler(usize),
    Same(ScaleSource),
    Polynomial(ScaleSource, Vec<f64>),
    /// Pairs of input and output, in ascending order of input.
    Table(ScaleSource, Vec<[f64; 2]>),
    /// The second plus the first times a factor of 1 or −1.
    Sum([ScaleSource; 2], f64),
    Bridge(ScaleSource, StrainBridge),
    Thermometer(ScaleSource, Thermometer),
    Thermistor(ScaleSource, Thermistor),
}

/// Strain `−k r / (a + b r)` from the ratio `r` of bridge voltage above `initial_v` to excitation.
#[derive(Debug, PartialEq)]
struct StrainBridge {
    initial_v: f64,
    excitation_v: f64,
    k: f64,
    a: f64,
    b: f64,
}

/// Resistance `R₀ (1 + A T + B T² + (T − 100 °C) C T³)`, the last term below 0 °C.
#[derive(Debug, PartialEq)]
struct Thermometer {
    current_a: f64,
    leads_ohm: f64,
    r0_ohm: f64,
    a: f64,
    b: f64,
    c: f64,
}

/// `1/T = a + b ln R + c (ln R)³`.
#[derive(Debug, PartialEq)]
struct Thermistor {
    is_by_current: bool,
    excitation: f64,
    reference_ohm: f64,
    leads_ohm: f64,
    a: f64,
    b: f64,
    c: f64,
    offset: f64,
}

/// Values of a channel: its series through the scales of the channel, its group or the file.
///
/// # Errors
/// Why there are none.
pub(super) fn scaled(
    mut series: Vec<RawSeries>,
    levels: [&Properties; 3],
) -> Result<Vec<f64>, String> {
    let Some((properties, count)) = levels.into_iter().find_map(|p| Some((p, scale_count(p)?)))
    else {
        return match series.len() {
            0 => Ok(Vec::new()),
            1 => Ok(series.swap_remove(0).values),
            _ => Err("DAQmx raw data without the scales that combine them".to_owned()),
        };
    };
    if series.is_empty() {
        return Ok(Vec::new());
    }
    let scales = chain(properties, count, &series)?;
    let stored = series.iter().find(|s| s.scale_id == RAW);
    let counts = series.iter().map(|s| s.values.len());
    let mut results = vec![0.0; scales.len()];
    let values = (0..counts.min().unwrap_or(0)).map(|i| {
        let raw = stored.map_or(f64::NAN, |s| s.values[i]);
        for (place, scale) in scales.iter().enumerate() {
            results[place] = scale.apply(raw, i, &series, &results);
        }
        results[results.len() - 1]
    });
    Ok(values.collect())
}

/// Number of scales to be applied, if any.
fn scale_count(properties: &Properties) -> Option<f64> {
    let is_done = matches!(properties.get("NI_Scaling_Status"), Some(Property::Text(text)) if text == "scaled");
    let count = match properties.get("NI_Number_Of_Scales") {
        Some(Property::Number(count)) => *count,
        Some(Property::Text(text)) => text.trim().parse().unwrap_or(0.0),
        _ => {
            let numbers = properties.keys().filter_map(|key| {
                let (number, rest) = key.strip_prefix("NI_Scale[")?.split_once(']')?;
                (rest == "_Scale_Type").then(|| number.parse::<u32>().ok())?
            });
            f64::from(numbers.max()?) + 1.0
        }
    };
    (count >= 1.0 && !is_done).then_some(count)
}

/// The scales required by the last one.
fn chain(
    properties: &Properties,
    count: f64,
    series: &[RawSeries],
) -> Result<Vec<ChannelScale>, String> {
    // Each has a property or a scaler.
    if count > (properties.len() + series.len()) as f64 {
        return Err(format!("{count} scales are declared, but missing"));
    }
    let count = count as usize;
    let mut scales: Vec<ChannelScale> = Vec::new();
    let mut needed = vec![false; count];
    needed[count - 1] = true;
    for number in (0..count).rev() {
        let scale = match needed[number] {
            true => (ScaleKeys { properties, number }).scale(series)?,
            false => ChannelScale::Unused,
        };
        for source in scale.sources() {
            match source {
                ScaleSource::Scale(other) if other < number => needed[other] = true,
                ScaleSource::Scale(other) => {
                    return Err(format!("scale {number} takes its input from scale {other}"));
                }
                ScaleSource::Stored if !series.iter().any(|s| s.scale_id == RAW) => {
                    return Err(format!("scale {number} takes DAQmx raw data as values"));
                }
                ScaleSource::Stored => {}
            }
        }
        scales.push(scale);
    }
    scales.reverse();
    Ok(scales)
}

/// Properties of a scale.
struct ScaleKeys<'a> {
    properties: &'a Properties,
    number: usize,
}

impl ScaleKeys<'_> {
    fn get(&self, key: &str) -> Option<&Property> {
        self.properties
            .get(&format!("NI_Scale[{}]_{key}", self.number))
    }

    fn f64(&self, key: &str) -> Result<f64, String> {
        match self.get(key) {
            Some(Property::Number(value)) => Ok(*value),
            _ => Err(format!("scale {} lacks {key}", self.number)),
        }
    }

    /// The numbers `KEY[0]` up to `KEY_Size` minus one; `otherwise` is the size if not given.
    fn numbers(&self, key: &str, otherwise: Option<f64>) -> Result<Vec<f64>, String> {
        let size = self.f64(&format!("{key}_Size"));
        let size = otherwise.map_or(size.clone(), |count| Ok(size.unwrap_or(count)))?;
        let mut values = Vec::new();
        while (values.len() as f64) < size {
            values.push(self.f64(&format!("{key}[{}]", values.len()))?);
        }
        Ok(values)
    }

    fn source(&self, key: &str) -> ScaleSource {
        match self.f64(&format!("{key}_Input_Source")) {
            Ok(number) if number >= 0.0 && number < f64::from(RAW) => {
                ScaleSource::Scale(number as usize)
            }
            _ => ScaleSource::Stored,
        }
    }

    fn scale(&self, series: &[RawSeries]) -> Result<ChannelScale, String> {
        let kind = match self.get("Scale_Type") {
            Some(Property::Text(kind)) => kind.trim(),
            _ => {
                let number = self.number as u32;
                let scaler = series.iter().position(|s| s.scale_id == number);
                return scaler
                    .map(ChannelScale::Scaler)
                    .ok_or_else(|| format!("scale {number} has no type"));
            }
        };
        let source = self.source(kind);
        let operand = |side| self.source(&format!("{kind}_{side}_Operand"));
        Ok(match kind {
            "AdvancedAPI" => ChannelScale::Same(source),
            "Linear" => {
                let [offset, slope] = [self.f64("Linear_Y_Intercept")?, self.f64("Linear_Slope")?];
                ChannelScale::Polynomial(source, vec![offset, slope])
            }
            "Polynomial" => ChannelScale::Polynomial(
                source,
                self.numbers("Polynomial_Coefficients", Some(4.0))?,
            ),
            "Table" => ChannelScale::Table(source, self.table()?),
            "Add" => ChannelScale::Sum([operand("Left"), operand("Right")], 1.0),
            // The left one subtracted from the right one, as in NI's readers.
            "Subtract" => ChannelScale::Sum([operand("Left"), operand("Right")], -1.0),
            "Strain" => ChannelScale::Bridge(source, self.bridge()?),
            "RTD" => ChannelScale::Thermometer(source, self.thermometer()?),
            "Thermistor" => ChannelScale::Thermistor(source, self.thermistor()?),
            other => {
                return Err(format!(
                    "its scale \"{other}\" is not supported; export it as text or with npTDMS"
                ));
            }
        })
    }

    fn table(&self) -> Result<Vec<[f64; 2]>, String> {
        let inputs = self.numbers("Table_Pre_Scaled_Values", None)?;
        let outputs = self.numbers("Table_Scaled_Values", None)?;
        let pairs = inputs.iter().zip(&outputs);
        let mut pairs: Vec<[f64; 2]> = pairs.map(|(input, output)| [*input, *output]).collect();
        if pairs.first() > pairs.last() {
            pairs.reverse();
        }
        let is_rising = pairs.windows(2).all(|pair| pair[0][0] < pair[1][0]);
        if inputs.len() != outputs.len() || pairs.is_empty() || !is_rising {
            return Err(format!(
                "scale {}: the inputs of its table are not monotonic, or differ in number from the outputs",
                self.number
            ));
        }
        Ok(pairs)
    }

    fn bridge(&self) -> Result<StrainBridge, String> {
        let f64 = |key| self.f64(&format!("Strain_{key}"));
        let ratio = f64("Poisson_Ratio")?;
        let (both, other) = (1.0 + ratio, 1.0 - ratio);
        let code = f64("Configuration")?;
        let (k, a, b, has_leads) = match code as u32 {
            // Full bridges of type I to III, half bridges, quarter bridges.
            10_183 => (1.0, 1.0, 0.0, false),
            10_184 => (2.0, both, 0.0, false),
            10_185 => (2.0, both, other, false),
            10_188 => (4.0, both, 2.0 * other, true),
            10_189 => (2.0, 1.0, 0.0, true),
            10_271 | 10_272 => (4.0, 1.0, 2.0, true),
            _ => return Err(format!("unknown strain gage configuration {code}")),
        };
        let leads = match has_leads {
            true => 1.0 + f64("Lead_Wire_Resistance")? / f64("Gage_Resistance")?,
            false => 1.0,
        };
        let gain = f64("Bridge_Shunt_Calibration_Gain_Adjustment")?;
        Ok(StrainBridge {
            initial_v: f64("Initial_Bridge_Voltage")?,
            excitation_v: f64("Voltage_Excitation")?,
            k: k * gain * leads / f64("Gage_Factor")?,
            a,
            b,
        })
    }

    /// Lead resistance included in the measured one.
    fn leads_ohm(&self, kind: &str, is_by_current: bool) -> Result<f64, String> {
        let wires = self.f64(&format!("{kind}_Resistance_Configuration"))?;
        let each = self.f64(&format!("{kind}_Lead_Wire_Resistance"))?;
        Ok(match wires as u32 {
            2 if is_by_current => 2.0 * each,
            3 => each,
            _ => 0.0,
        })
    }

    fn thermometer(&self) -> Result<Thermometer, String> {
        Ok(Thermometer {
            current_a: self.f64("RTD_Current_Excitation")?,
            leads_ohm: self.leads_ohm("RTD", true)?,
            r0_ohm: self.f64("RTD_R0_Nominal_Resistance")?,
            a: self.f64("RTD_A")?,
            b: self.f64("RTD_B")?,
            c: self.f64("RTD_C")?,
        })
    }

    fn thermistor(&self) -> Result<Thermistor, String> {
        let kind = self.f64("Thermistor_Excitation_Type")?;
        if kind != BY_CURRENT && kind != BY_VOLTAGE {
            return Err(format!("unknown thermistor excitation {kind}"));
        }
        let is_by_current = kind == BY_CURRENT;
        Ok(Thermistor {
            is_by_current,
            excitation: self.f64("Thermistor_Excitation_Value")?,
            reference_ohm: self.f64("Thermistor_R1_Reference_Resistance")?,
            leads_ohm: self.leads_ohm("Thermistor", is_by_current)?,
            a: self.f64("Thermistor_A")?,
            b: self.f64("Thermistor_B")?,
            c: self.f64("Thermistor_C")?,
            offset: self.f64("Thermistor_Temperature_Offset")?,
        })
    }
}

impl ChannelScale {
    fn sources(&self) -> Vec<ScaleSource> {
        match self {
            Self::Unused | Self::Scaler(_) => Vec::new(),
            Self::Sum(both, _) => both.to_vec(),
            Self::Same(source)
            | Self::Polynomial(source, _)
            | Self::Table(source, _)
            | Self::Bridge(source, _)
            | Self::Thermometer(source, _)
            | Self::Thermistor(source, _) => vec![*source],
        }
    }

    /// Result for a sample, from the stored value and the results of preceding scales.
    fn apply(&self, stored: f64, sample: usize, series: &[RawSeries], results: &[f64]) -> f64 {
        let of = |source: &ScaleSource| match source {
            ScaleSource::Stored => stored,
            ScaleSource::Scale(number) => results[*number],
        };
        match self {
            Self::Unused => f64::NAN,
            Self::Scaler(place) => series[*place].values[sample],
            Self::Same(source) => of(source),
            Self::Polynomial(source, coefficients) => {
                let x = of(source);
                let backwards = coefficients.iter().rev();
                backwards.fold(0.0, |sum, coefficient| sum * x + coefficient)
            }
            Self::Table(source, pairs) => interpolated(pairs, of(source)),
            Self::Sum([left, right], sign) => of(right) + sign * of(left),
            Self::Bridge(source, bridge) => bridge.strain(of(source)),
            Self::Thermometer(source, thermometer) => thermometer.celsius(of(source)),
            Self::Thermistor(source, thermistor) => thermistor.temperature(of(source)),
        }
    }
}

/// Linear interpolation in a table, constant beyond its ends.
fn interpolated(pairs: &[[f64; 2]], x: f64) -> f64 {
    let above = pairs.partition_point(|pair| pair[0] <= x);
    match (above.checked_sub(1), pairs.get(above)) {
        _ if x.is_nan() => f64::NAN,
        (Some(below), Some([x1, y1])) => {
            let [x0, y0] = pairs[below];
            y0 + (y1 - y0) / (x1 - x0) * (x - x0)
        }
        (Some(last), None) => pairs[last][1],
        (None, first) => first.map_or(f64::NAN, |[_, y]| *y),
    }
}

impl StrainBridge {
    fn strain(&self, voltage: f64) -> f64 {
        let ratio = (voltage - self.initial_v) / self.excitation_v;
        -self.k * ratio / (self.a + self.b * ratio)
    }
}

impl Thermometer {
    fn celsius(&self, voltage: f64) -> f64 {
        let ratio = (voltage / self.current_a - self.leads_ohm) / self.r0_ohm;
        let Self { a, b, c, .. } = self;
        let mut t = (-a + (a * a - 4.0 * b * (1.0 - ratio)).sqrt()) / (2.0 * b);
        if ratio >= 1.0 {
            return t;
        }
        // Newton's method: at −200 °C four steps eliminate the difference of 2 K.
        for _ in 0..8 {
            let off = 1.0 + t * (a + t * (b + (t - 100.0) * c * t)) - ratio;
            t -= off / (a + t * (2.0 * b + t * c * (4.0 * t - 300.0)));
        }
        t
    }
}

impl Thermistor {
    fn temperature(&self, voltage: f64) -> f64 {
        let measured = match self.is_by_current {
            true => voltage / self.excitation,
            false => self.reference_ohm / (self.excitation / voltage - 1.0),
        };
        let log = (measured - self.leads_ohm).ln();
        1.0 / (self.a + log * (self.b + self.c * log * log)) - self.offset
    }
}
