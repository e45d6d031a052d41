//! From metres to points, and the axes around a drawing.

use mpgx_lang::plan::Area;

use super::pen::{SOFT, num, path};
use crate::svg::ticks;
use crate::text::Format;

/// Where an area of the plane lies in the picture; both axes have one scale.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    pub area: Area,
    pub left: f64,
    pub top: f64,
    pub width: f64,
}

impl Frame {
    /// Points a metre.
    pub fn scale(&self) -> f64 {
        self.width / (self.area.x_m.1 - self.area.x_m.0)
    }

    pub fn height(&self) -> f64 {
        self.scale() * (self.area.y_m.1 - self.area.y_m.0)
    }

    /// The place of a position.
    pub fn at(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let scale = self.scale();
        [self.left + scale * (x - self.area.x_m.0), self.top + scale * (self.area.y_m.1 - y)]
    }

    /// A drawing that is cut off at the frame.
    pub fn clipped(&self, drawing: &str) -> String {
        let [x, y, width, height] = [self.left, self.top, self.width, self.height()].map(num);
        format!(
            r#"<svg x="{x}" y="{y}" width="{width}" height="{height}" viewBox="{x} {y} {width} {height}">{drawing}</svg>"#
        )
    }

    /// Border, ticks and labels; those of y only if there is room on the left.
    pub fn axes(&self, labels_y: bool) -> String {
        let Frame { area, left, top, width } = *self;
        let (right, bottom) = (left + width, top + self.height());
        let border = path([[left, top], [right, top], [right, bottom], [left, bottom]], "z");
        let metres = Format { unit: "m", factor: 1.0, digits: 0 };
        let mut marks = String::new();
        let mut labels = String::new();
        for tick in ticks(area.x_m, 5, metres) {
            let [x, _] = self.at([tick.value, 0.0]);
            marks += &path([[x, bottom], [x, bottom + 2.5]], "");
            labels += &format!(r#"<text x="{}" y="{}">{}</text>"#, num(x), num(bottom + 9.5), tick.label);
        }
        labels += &format!(
            r#"<text x="{}" y="{}" font-size="8">x (m)</text>"#,
            num((left + right) / 2.0),
            num(bottom + 20.0)
        );
        for tick in ticks(area.y_m, 5, metres) {
            let [_, y] = self.at([0.0, tick.value]);
            marks += &path([[left, y], [left - 2.5, y]], "");
            if labels_y {
                let (x, y) = (num(left - 4.5), num(y + 2.4));
                labels += &format!(r#"<text x="{x}" y="{y}" text-anchor="end">{}</text>"#, tick.label);
            }
        }
        if labels_y {
            let (x, y) = (num(left - 21.0), num((top + bottom) / 2.0));
            labels +=
                &format!(r#"<text transform="translate({x} {y}) rotate(-90)" font-size="8">y (m)</text>"#);
        }
        format!(
            r#"<path d="{border}{marks}" fill="none" stroke="{SOFT}" stroke-width=".6"/><g font-size="7" text-anchor="middle">{labels}</g>"#
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn positions_have_their_places() {
        let frame =
            Frame { area: Area { x_m: (-1.0, 3.0), y_m: (0.0, 2.0) }, left: 10.0, top: 20.0, width: 200.0 };
        assert_eq!((frame.scale(), frame.height()), (50.0, 100.0));
        assert_eq!(frame.at([-1.0, 2.0]), [10.0, 20.0]);
        assert_eq!(frame.at([3.0, 0.0]), [210.0, 120.0]);
        assert_eq!(frame.at([0.0, 0.0]), [60.0, 120.0]);
        let axes = frame.axes(true);
        assert!(axes.contains(r#"<text x="60" y="129.5">0</text>"#), "{axes}");
        assert!(!frame.axes(false).contains("y (m)"));
    }
}
