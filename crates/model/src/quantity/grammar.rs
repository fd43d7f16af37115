//! Grammar of unit text: characters → tokens → unit.

use super::error::QuantityError;
use super::symbols::{self, Symbol};
use super::unit::Unit;

/// Maximum length of unit text. Real units have some 20 characters.
const MAX_LENGTH: usize = 200;
/// Maximum nesting of parentheses.
const MAX_DEPTH: usize = 4;
/// Maximum power. The limits together keep the exponents far from overflow.
const MAX_POWER: i32 = 9;

/// Speeds in revolutions per minute, as recorders write them.
const PER_MINUTE: [&str; 4] = ["1/min", "min^-1", "min-1", "/min"];
/// Symbols of mass that are also used for force, with that force.
const WEIGHTS: [(&[&str], &str); 4] = [
    (&["lb", "lbs", "pound", "pounds"], "lbf"),
    (&["oz", "ounce", "ounces"], "ozf"),
    (&["kg"], "kgf"),
    (&["g"], "gf"),
];

/// A unit text with its masses read as forces, and as unambiguous masses: `in-lb` becomes `in-lbf` and `in-lbm`;
/// `None` without a mass.
pub(super) fn readings_of_weight(text: &str) -> Option<[String; 2]> {
    let plain = plain_signs(text.trim());
    let mut readings = [String::new(), String::new()];
    let mut found = false;
    let mut rest = plain.as_str();
    while let Some(sign) = rest.chars().next() {
        let letters = rest.find(|c: char| !is_letter(c)).unwrap_or(rest.len());
        let (word, after) = rest.split_at(letters.max(sign.len_utf8()));
        let lower = word.to_lowercase();
        let force = WEIGHTS
            .iter()
            .find(|(names, _)| names.contains(&lower.as_str()));
        found |= force.is_some();
        readings[0] += force.map_or(word, |(_, force)| force);
        readings[1] += match force {
            Some((_, "lbf")) => "lbm",
            Some((_, "ozf")) => "ozm",
            _ => word,
        };
        rest = after;
    }
    found.then_some(readings)
}

/// Whether a unit contains a minute that is not part of a speed.
pub(super) fn has_bare_minute(text: &str) -> bool {
    let plain = plain_signs(text.trim());
    let is_speed = ["1/min", "min^-1", "min-1"]
        .iter()
        .any(|speed| plain.contains(speed));
    let mut words = plain.split(|c: char| !is_letter(c));
    !is_speed && words.any(|word| ["min", "minute", "minutes"].contains(&word))
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Token {
    Symbol(&'static Symbol),
    One,
    Times,
    Per,
    Power(i32),
    Open,
    Close,
}

/// Parses unit text. Empty text and `1` are the unit of pure numbers.
pub(super) fn read(text: &str) -> Result<Unit, QuantityError> {
    if text.len() > MAX_LENGTH {
        return Err(syntax(text, "it is too long"));
    }
    let mut plain = plain_signs(text.trim());
    if PER_MINUTE.contains(&plain.as_str()) {
        // Revolutions per minute: angles are not given in rad per minute.
        plain = "rpm".to_owned();
    }
    for speed in ["/(1/min)", "/(min^-1)", "/min^-1", "/min-1"] {
        plain = plain.replace(speed, "/rpm");
    }
    let tokens = Lexer { text, rest: &plain }.tokens()?;
    if tokens.is_empty() {
        return Ok(Unit::ONE);
    }
    if let [Token::Symbol(symbol)] = tokens[..] {
        return Ok(Unit::of_scale(symbol));
    }
    let mut parser = Parser {
        text,
        tokens: &tokens,
        next: 0,
    };
    let unit = parser.product(0)?;
    if parser.next < tokens.len() {
        return Err(syntax(text, "a closing parenthesis has no opening one"));
    }
    if !(unit.factor().is_finite() && unit.factor() > 0.0) {
        return Err(syntax(text, "its factor to SI units is out of range"));
    }
    Ok(unit)
}

fn syntax(text: &str, problem: &'static str) -> QuantityError {
    QuantityError::UnitSyntax {
        unit: text.to_owned(),
        problem,
    }
}

/// Replaces non-ASCII characters: µ and μ by `u`, Ω by `ohm`, ° by `deg`, ε by `strain`,
/// superscripts by `^` and digits, multiplication signs by `*`.
fn plain_signs(text: &str) -> String {
    let mut plain = String::with_capacity(text.len() + 8);
    let mut in_superscript = false;
    for sign in text.chars() {
        let superscript = superscript(sign);
        if let Some(digit) = superscript {
            if !in_superscript {
                plain.push('^');
            }
            plain.push(digit);
        } else {
            match sign {
                'µ' | 'μ' => plain.push('u'),
                'Ω' | '\u{2126}' => plain.push_str("ohm"),
                '°' => plain.push_str("deg"),
                'ε' => plain.push_str("strain"),
                '·' | '⋅' | '×' | '•' => plain.push('*'),
                '−' | '‐' | '‑' => plain.push('-'),
                other => plain.push(other),
            }
        }
        in_superscript = superscript.is_some();
    }
    plain
}

fn superscript(sign: char) -> Option<char> {
    const SUPERSCRIPTS: [char; 11] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹', '⁻'];
    const PLAIN: [char; 11] = ['0', '1', '2', '3', '4', '5', '6', '7', '8', '9', '-'];
    SUPERSCRIPTS
        .iter()
        .position(|s| *s == sign)
        .map(|i| PLAIN[i])
}

struct Lexer<'a> {
    /// Unit text as given, for messages.
    text: &'a str,
    rest: &'a str,
}

impl<'a> Lexer<'a> {
    fn tokens(mut self) -> Result<Vec<Token>, QuantityError> {
        let mut tokens = Vec::new();
        loop {
            let gap = self.rest.starts_with(char::is_whitespace);
            self.rest = self.rest.trim_start();
            let Some(sign) = self.rest.chars().next() else {
                return Ok(tokens);
            };
            // A power without `^` must follow its base directly: `m2`, `s-1`.
            let touches = !gap && matches!(tokens.last(), Some(Token::Symbol(_) | Token::Close));
            let token = match sign {
                '-' if touches && self.digit_after_minus() => self.power()?,
                '0'..='9' if touches => self.power()?,
                '*' | '.' | '-' => self.sign(Token::Times),
                '/' => self.sign(Token::Per),
                '(' => self.sign(Token::Open),
                ')' => self.sign(Token::Close),
                '^' => {
                    self.rest = &self.rest[1..];
                    self.power()?
                }
                '1' if !self.rest[1..].starts_with(|c: char| c.is_ascii_digit()) => {
                    self.sign(Token::One)
                }
                '0'..='9' => {
                    return Err(syntax(
                        self.text,
                        "a unit may contain no number other than 1",
                    ));
                }
                _ => self.symbol()?,
            };
            tokens.push(token);
        }
    }

    /// Consumes one ASCII character.
    fn sign(&mut self, token: Token) -> Token {
        self.rest = &self.rest[1..];
        token
    }

    fn digit_after_minus(&self) -> bool {
        self.rest[1..].starts_with(|c: char| c.is_ascii_digit())
    }

    /// Consumes a signed integer.
    fn power(&mut self) -> Result<Token, QuantityError> {
        let (negative, digits) = match self.rest.strip_prefix('-') {
            Some(digits) => (true, digits),
            None => (false, self.rest),
        };
        let end = digits
            .find(|c: char| !c.is_ascii_digit())
            .unwrap_or(digits.len());
        let value: i32 = digits[..end].parse().map_err(|_| {
            syntax(
                self.text,
                "a power must be a whole number, as in m^2 or s^-1",
            )
        })?;
        if !(1..=MAX_POWER).contains(&value) {
            return Err(syntax(
                self.text,
                "a power must be between 1 and 9, or -1 and -9",
            ));
        }
        self.rest = &digits[end..];
        Ok(Token::Power(if negative { -value } else { value }))
    }

    /// Consumes a word: a symbol of a unit, or `per`.
    fn symbol(&mut self) -> Result<Token, QuantityError> {
        let end = self.word_end();
        let word = &self.rest[..end];
        if word.eq_ignore_ascii_case("per") {
            self.rest = &self.rest[end..];
            return Ok(Token::Per);
        }
        // The digit of `g0` is not a power.
        if word == "g" && self.rest[end..].starts_with('0') {
            self.rest = &self.rest[end + 1..];
            return Ok(Token::Symbol(self.find("g0")?));
        }
        if let Some((name, length)) = self.joined(word) {
            self.rest = &self.rest[length..];
            return Ok(Token::Symbol(self.find(&name)?));
        }
        let end = self.mass_of_inertia(word).map_or(end, str::len);
        let symbol = self.find(&self.rest[..end])?;
        self.rest = &self.rest[end..];
        Ok(Token::Symbol(symbol))
    }

    /// The mass before a squared length, as in `kgm2`: motor data sheets write inertias like this.
    fn mass_of_inertia(&self, word: &str) -> Option<&'static str> {
        let power = &self.rest[word.len()..];
        let is_squared = power.strip_prefix('^').unwrap_or(power).starts_with('2');
        let is_length = |length: &str| matches!(length, "m" | "cm" | "mm");
        let mut masses = ["kg", "g"].into_iter().filter(|_| is_squared);
        masses.find(|mass| word.strip_prefix(mass).is_some_and(is_length))
    }

    /// Two words that are one unit: `pound-force`, `pound mass`, `deg F`.
    fn joined(&self, word: &str) -> Option<(String, usize)> {
        let tail = self.rest[word.len()..].strip_prefix(['-', ' '])?;
        let end = tail.find(|c: char| !is_letter(c)).unwrap_or(tail.len());
        let second = &tail[..end];
        let length = word.len() + 1 + end;
        let is = |known: &str| second.eq_ignore_ascii_case(known);
        if is("force") || is("mass") {
            return Some((format!("{word}-{second}"), length));
        }
        let degree = ["deg", "degree", "degrees"]
            .iter()
            .any(|d| word.eq_ignore_ascii_case(d));
        if degree && (second == "C" || is("celsius")) {
            return Some(("degC".to_owned(), length));
        }
        if degree && (second == "F" || is("fahrenheit")) {
            return Some(("degF".to_owned(), length));
        }
        None
    }

    /// End of the leading word, at least one character.
    fn word_end(&self) -> usize {
        let letters = self
            .rest
            .find(|c: char| !is_letter(c))
            .unwrap_or(self.rest.len());
        if letters > 0 {
            return letters;
        }
        self.rest.chars().next().map_or(0, char::len_utf8)
    }

    fn find(&self, symbol: &str) -> Result<&'static Symbol, QuantityError> {
        if symbol.eq_ignore_ascii_case("grad") {
            return Err(syntax(
                self.text,
                "\"grad\" is a degree to some and a gradian (0.9 degrees) to others; write deg or gon",
            ));
        }
        if COUNTS.iter().any(|word| symbol.eq_ignore_ascii_case(word)) {
            return Err(syntax(
                self.text,
                "counts of a converter have no unit; call one count 1 V in every step (--reading-unit V where they are \
                 calibrated, --unit V where they are used), and scale those of an encoder to an angle",
            ));
        }
        symbols::find(symbol).ok_or_else(|| QuantityError::UnknownUnit {
            symbol: symbol.to_owned(),
            unit: self.text.to_owned(),
            nearest: symbols::nearest(symbol),
        })
    }
}

/// Words for the numbers of a converter or a counter.
const COUNTS: [&str; 9] = [
    "count", "counts", "cnt", "cts", "LSB", "digit", "digits", "bits", "ADC",
];

fn is_letter(sign: char) -> bool {
    sign.is_alphabetic() || sign == '%'
}

struct Parser<'a> {
    /// Unit text as given, for messages.
    text: &'a str,
    tokens: &'a [Token],
    next: usize,
}

impl Parser<'_> {
    fn peek(&self) -> Option<Token> {
        self.tokens.get(self.next).copied()
    }

    /// product = ["/"] factor { ["*" | "/"] factor }, up to a closing parenthesis or the end.
    fn product(&mut self, depth: usize) -> Result<Unit, QuantityError> {
        let mut unit = Unit::ONE;
        let mut first = true;
        let mut divided = false;
        loop {
            let operator = match self.peek() {
                None | Some(Token::Close) if !first => return Ok(unit),
                Some(Token::Times) if first => {
                    return Err(syntax(self.text, "a product has no left operand"));
                }
                Some(operator @ (Token::Times | Token::Per)) => {
                    self.next += 1;
                    operator
                }
                _ => Token::Times,
            };
            if operator == Token::Times && divided {
                return Err(syntax(
                    self.text,
                    "a product after a division can be read in two ways; put the product first, \
                     or the divisor in parentheses",
                ));
            }
            let factor = self.factor(depth)?;
            divided |= operator == Token::Per;
            unit = unit.times(if operator == Token::Per {
                factor.power(-1)
            } else {
                factor
            });
            first = false;
        }
    }

    /// factor = (symbol | "1" | "(" product ")") [power]
    fn factor(&mut self, depth: usize) -> Result<Unit, QuantityError> {
        let token = self.peek();
        self.next += 1;
        let base = match token {
            Some(Token::Symbol(symbol)) => Unit::of_factor(symbol),
            Some(Token::One) => Unit::ONE,
            Some(Token::Open) if depth < MAX_DEPTH => self.group(depth)?,
            Some(Token::Open) => return Err(syntax(self.text, "parentheses nest too deep")),
            Some(Token::Power(_)) => {
                return Err(syntax(self.text, "a power has no base"));
            }
            Some(Token::Times | Token::Per) => {
                return Err(syntax(self.text, "two operators follow each other"));
            }
            Some(Token::Close) | None => {
                return Err(syntax(
                    self.text,
                    "a unit is missing at the end or before \")\"",
                ));
            }
        };
        let Some(Token::Power(exponent)) = self.peek() else {
            return Ok(base);
        };
        self.next += 1;
        Ok(base.power(exponent))
    }

    fn group(&mut self, depth: usize) -> Result<Unit, QuantityError> {
        let unit = self.product(depth + 1)?;
        if self.peek() != Some(Token::Close) {
            return Err(syntax(self.text, "an opening parenthesis is not closed"));
        }
        self.next += 1;
        Ok(unit)
    }
}
