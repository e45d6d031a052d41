//! Colours. Those of values grow evenly in lightness from blue to sand, so that they can be told apart by the
//! colour blind and in grey.

/// a and b of OKLab (Ottosson 2020) at even steps of lightness from [`DARKEST`] to [`LIGHTEST`].
const STOPS: [[f64; 2]; 5] =
    [[0.005, -0.095], [-0.045, -0.080], [-0.070, -0.020], [-0.040, 0.045], [0.0, 0.05]];
const DARKEST: f64 = 0.42;
const LIGHTEST: f64 = 0.97;

/// The colour of a share of the range, 0 to 1, as `#rrggbb`.
pub fn colour(share: f64) -> String {
    let share = share.clamp(0.0, 1.0);
    let place = share * (STOPS.len() - 1) as f64;
    let stop = |k: f64| STOPS.get(k as usize).or(STOPS.last()).copied().unwrap_or_default();
    let (below, above) = (stop(place.floor()), stop(place.ceil()));
    let mix = |k: usize| below[k] + (above[k] - below[k]) * (place - place.floor());
    let [r, g, b] = srgb(DARKEST + share * (LIGHTEST - DARKEST), mix(0), mix(1));
    format!("#{r:02x}{g:02x}{b:02x}")
}

/// From OKLab (Ottosson 2020).
fn srgb(lightness: f64, a: f64, b: f64) -> [u8; 3] {
    let cube = |x: f64| x * x * x;
    let l = cube(lightness + 0.3963377774 * a + 0.2158037573 * b);
    let m = cube(lightness - 0.1055613458 * a - 0.0638541728 * b);
    let s = cube(lightness - 0.0894841775 * a - 1.2914855480 * b);
    let linear = [
        4.0767416621 * l - 3.3077115913 * m + 0.2309699292 * s,
        -1.2684380046 * l + 2.6097574011 * m - 0.3413193965 * s,
        -0.0041960863 * l - 0.7034186147 * m + 1.7076147010 * s,
    ];
    linear.map(|x| {
        let x = x.clamp(0.0, 1.0);
        let x = if x <= 0.0031308 { 12.92 * x } else { 1.055 * libm::pow(x, 1.0 / 2.4) - 0.055 };
        (255.0 * x).round() as u8
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Lightness L* of CIE 1976.
    fn lightness(colour: &str) -> f64 {
        let channel = |k: usize| {
            let x = f64::from(u8::from_str_radix(&colour[k..k + 2], 16).unwrap()) / 255.0;
            if x <= 0.04045 { x / 12.92 } else { libm::pow((x + 0.055) / 1.055, 2.4) }
        };
        116.0 * libm::cbrt(0.2126 * channel(1) + 0.7152 * channel(3) + 0.0722 * channel(5)) - 16.0
    }

    /// Readable in grey: even steps of lightness, none backwards.
    #[test]
    fn lightness_grows_evenly() {
        let all: Vec<f64> = (0..=10).map(|k| lightness(&colour(f64::from(k) / 10.0))).collect();
        let mean = (all[10] - all[0]) / 10.0;
        assert!(mean > 5.0, "{all:?}");
        for pair in all.windows(2) {
            assert!((pair[1] - pair[0] - mean).abs() < 0.25 * mean, "{all:?}");
        }
    }

    #[test]
    fn any_share_has_a_colour() {
        assert_eq!(colour(-1.0), colour(0.0));
        assert_eq!(colour(7.0), colour(1.0));
        assert_eq!(colour(f64::NAN).len(), 7);
    }
}
