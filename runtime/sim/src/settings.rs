//! Reading the settings of an [`Extern`].

use mpgx_lang::plan::{Extern, Place, Setting};

use crate::error::SimError;

/// The settings of one body or controller, known to be exactly those that it reads.
pub(crate) struct Settings<'a> {
    what: &'a Extern,
    at: &'a Place,
}

impl<'a> Settings<'a> {
    /// Refuses settings that are not in `known`.
    pub fn new(what: &'a Extern, known: &[&str], at: &'a Place) -> Result<Self, SimError> {
        match what.settings.keys().find(|name| !known.contains(&name.as_str())) {
            None => Ok(Settings { what, at }),
            Some(setting) => Err(SimError::UnknownSetting {
                owner: format!("`{}`", what.name),
                setting: setting.clone(),
                known: list(known),
                at: at.clone(),
            }),
        }
    }

    pub fn has(&self, name: &str) -> bool {
        self.what.settings.contains_key(name)
    }

    /// A finite number above 0, or from 0 on if `zero`.
    pub fn positive(&self, name: &'static str, zero: bool) -> Result<f64, SimError> {
        let expected = if zero { "a finite number, not negative" } else { "a finite number above 0" };
        match self.get(name, expected)? {
            &Setting::Number(x) if x.is_finite() && (x > 0.0 || zero && x == 0.0) => Ok(x),
            _ => Err(self.bad(name, expected)),
        }
    }

    /// A whole number from `least` to `most`.
    pub fn count(&self, name: &'static str, least: usize, most: usize) -> Result<usize, SimError> {
        let expected = "a whole number in its range";
        match self.get(name, expected)? {
            &Setting::Number(x) if x.fract() == 0.0 && (least as f64..=most as f64).contains(&x) => {
                Ok(x as usize)
            }
            _ => Err(self.bad(name, expected)),
        }
    }

    /// Yes or no.
    pub fn truth(&self, name: &'static str) -> Result<bool, SimError> {
        let expected = "true or false";
        match self.get(name, expected)? {
            &Setting::Truth(truth) => Ok(truth),
            _ => Err(self.bad(name, expected)),
        }
    }

    /// A finite range whose low end is not above its high end.
    pub fn range(&self, name: &'static str) -> Result<(f64, f64), SimError> {
        let expected = "a finite range, low limit first";
        match self.get(name, expected)? {
            &Setting::Range(low, high) if low.is_finite() && high.is_finite() && low <= high => {
                Ok((low, high))
            }
            _ => Err(self.bad(name, expected)),
        }
    }

    fn get(&self, setting: &'static str, expected: &'static str) -> Result<&Setting, SimError> {
        self.what.settings.get(setting).ok_or_else(|| SimError::MissingSetting {
            owner: format!("`{}`", self.what.name),
            setting,
            expected,
            at: self.at.clone(),
        })
    }

    fn bad(&self, setting: &'static str, expected: &'static str) -> SimError {
        SimError::BadSetting {
            owner: format!("`{}`", self.what.name),
            setting,
            expected,
            at: self.at.clone(),
        }
    }
}

/// `a, b, c`, or `nothing`.
pub(crate) fn list(names: &[&str]) -> String {
    if names.is_empty() { "nothing".into() } else { names.join(", ") }
}
