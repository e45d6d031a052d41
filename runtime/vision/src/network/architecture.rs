//! Which residual network, and the names and shapes of its tensors: plain numbers, known before any memory is taken.

use mpgx_random::{Address, Purpose};
use serde::{Deserialize, Serialize};

use crate::world::{ConfigError, within};

/// The size of a residual network.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ResNetConfig {
    /// 18, 34 or 50.
    pub depth: usize,
    /// Of the first stage; each further stage has twice as many. The paper of residual networks has 64.
    pub channels: usize,
    pub stem: Stem,
    /// Of the images that it looks at.
    pub width_px: usize,
    pub height_px: usize,
}

/// What comes before the first stage.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Stem {
    /// 7 × 7 with stride 2 and a pool with stride 2.
    #[default]
    Standard,
    /// 3 × 3 without strides, for small images.
    Small,
}

impl Default for ResNetConfig {
    fn default() -> ResNetConfig {
        ResNetConfig { depth: 18, channels: 64, stem: Stem::Standard, width_px: 64, height_px: 64 }
    }
}

/// A block: channels before, inside and after it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BlockShape {
    pub from: usize,
    pub inner: usize,
    pub to: usize,
    pub stride: usize,
    pub bottleneck: bool,
}

impl BlockShape {
    /// Whether the shortcut needs a convolution.
    pub fn resizes(&self) -> bool {
        self.stride != 1 || self.from != self.to
    }
}

/// A tensor of a network.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Slot {
    /// As in torchvision's `state_dict`.
    pub name: String,
    pub shape: Vec<usize>,
    role: Role,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Role {
    Convolution,
    Scale,
    Offset,
    Mean,
    Variance,
    Linear,
}

impl ResNetConfig {
    pub fn check(&self) -> Result<(), ConfigError> {
        if ![18, 34, 50].contains(&self.depth) {
            let (what, value) = ("the depth of the network", self.depth as f64);
            return Err(ConfigError::OutOfRange { what, value, must: "18, 34 or 50" });
        }
        within("the channels of the first stage", self.channels as f64, (1.0, 256.0), "1 to 256")?;
        for (what, side) in
            [("the width of its images", self.width_px), ("the height of its images", self.height_px)]
        {
            within(what, side as f64, (16.0, 512.0), "16 to 512 pixels")?;
        }
        Ok(())
    }

    /// The four stages.
    pub(crate) fn stages(&self) -> Vec<Vec<BlockShape>> {
        let counts = match self.depth {
            18 => [2, 2, 2, 2],
            _ => [3, 4, 6, 3],
        };
        let bottleneck = self.depth == 50;
        let mut from = self.channels;
        let stages = counts.into_iter().enumerate().map(|(stage, count)| {
            let inner = self.channels << stage;
            let to = if bottleneck { 4 * inner } else { inner };
            let block = |number: usize| {
                let stride = if number == 0 && stage > 0 { 2 } else { 1 };
                let from = std::mem::replace(&mut from, to);
                BlockShape { from, inner, to, stride, bottleneck }
            };
            (0..count).map(block).collect()
        });
        stages.collect()
    }

    /// Numbers that its layers tell of one image before the last: what each convolution, normalisation and rectifier gives.
    pub(crate) fn features(&self) -> usize {
        let halved = |count: usize| count.div_ceil(2);
        let (mut width, mut height) = (self.width_px, self.height_px);
        if self.stem == Stem::Standard {
            (width, height) = (halved(width), halved(height));
        }
        let mut sum = 3 * self.channels * width * height;
        if self.stem == Stem::Standard {
            (width, height) = (halved(width), halved(height));
        }
        for block in self.stages().iter().flatten() {
            let before = width * height;
            if block.stride == 2 {
                (width, height) = (halved(width), halved(height));
            }
            let (after, bottleneck) = (width * height, block.bottleneck);
            let first = if bottleneck { before } else { after };
            sum += 3 * block.inner * (first + if bottleneck { after } else { 0 }) + 3 * block.to * after;
            sum += if block.resizes() { 2 * block.to * after } else { 0 };
        }
        sum
    }

    /// All tensors, in the order in which a visitor of the network meets them.
    pub(crate) fn layout(&self, outputs: usize) -> Vec<Slot> {
        let mut layout = Layout::default();
        let side = if self.stem == Stem::Standard { 7 } else { 3 };
        layout.convolution("conv1", self.channels, 3, side);
        layout.norm("bn1", self.channels);
        let mut features = self.channels;
        for (stage, blocks) in self.stages().iter().enumerate() {
            for (number, block) in blocks.iter().enumerate() {
                layout.block(&format!("layer{}.{number}", stage + 1), block);
                features = block.to;
            }
        }
        layout.add("fc.weight".into(), vec![outputs, features], Role::Linear);
        layout.add("fc.bias".into(), vec![outputs], Role::Offset);
        layout.0
    }
}

#[derive(Default)]
struct Layout(Vec<Slot>);

impl Layout {
    fn add(&mut self, name: String, shape: Vec<usize>, role: Role) {
        self.0.push(Slot { name, shape, role });
    }

    fn convolution(&mut self, name: &str, to: usize, from: usize, side: usize) {
        self.add(format!("{name}.weight"), vec![to, from, side, side], Role::Convolution);
    }

    fn norm(&mut self, name: &str, channels: usize) {
        for (part, role) in [
            ("weight", Role::Scale),
            ("bias", Role::Offset),
            ("running_mean", Role::Mean),
            ("running_var", Role::Variance),
        ] {
            self.add(format!("{name}.{part}"), vec![channels], role);
        }
    }

    fn block(&mut self, name: &str, block: &BlockShape) {
        let &BlockShape { from, inner, to, bottleneck, .. } = block;
        self.convolution(&format!("{name}.conv1"), inner, from, if bottleneck { 1 } else { 3 });
        self.norm(&format!("{name}.bn1"), inner);
        self.convolution(&format!("{name}.conv2"), inner, inner, 3);
        self.norm(&format!("{name}.bn2"), inner);
        if bottleneck {
            self.convolution(&format!("{name}.conv3"), to, inner, 1);
            self.norm(&format!("{name}.bn3"), to);
        }
        if block.resizes() {
            self.convolution(&format!("{name}.downsample.0"), to, from, 1);
            self.norm(&format!("{name}.downsample.1"), to);
        }
    }
}

impl Slot {
    pub fn count(&self) -> usize {
        self.shape.iter().product()
    }

    /// Whether gradients change it; the running statistics follow the images.
    pub fn trained(&self) -> bool {
        !matches!(self.role, Role::Mean | Role::Variance)
    }

    /// What it starts from, as torchvision: convolutions by He et al. (2015) over what leaves them, the last layer uniform.
    /// `number` is its place in the layout.
    pub fn initial(&self, number: usize, seed: u64) -> Vec<f32> {
        let address = Address {
            master: seed,
            purpose: Purpose::Weights,
            protocol: 0,
            part: number as u16,
            seed: 0,
            episode: 0,
            step: 0,
        };
        let stream = &mut address.stream();
        let draw = |_| match self.role {
            Role::Convolution => {
                let leaving = self.shape[0] * self.shape[2] * self.shape[3];
                stream.normal() * (2.0 / leaving as f64).sqrt()
            }
            Role::Linear => (2.0 * stream.uniform() - 1.0) / (self.shape[1] as f64).sqrt(),
            Role::Scale | Role::Variance => 1.0,
            Role::Offset | Role::Mean => 0.0,
        };
        (0..self.count()).map(draw).map(|value| value as f32).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The numbers of parameters that torchvision tells for 1000 classes.
    #[test]
    fn the_networks_have_as_many_parameters_as_torchvisions() {
        for (depth, parameters) in [(18, 11_689_512), (34, 21_797_672), (50, 25_557_032)] {
            let layout = ResNetConfig { depth, ..ResNetConfig::default() }.layout(1000);
            let count: usize = layout.iter().filter(|slot| slot.trained()).map(Slot::count).sum();
            assert_eq!(count, parameters, "{depth}");
        }
    }

    /// By hand, stem and stages, for one channel, 32 × 32 pixels and then as many channels and pixels as told.
    #[test]
    fn all_that_layers_tell_is_counted() {
        let small = ResNetConfig { stem: Stem::Small, channels: 1, width_px: 32, height_px: 32, depth: 18 };
        let shallow = 3_072 + (12_288 + 7_168 + 3_584 + 1_792);
        assert_eq!(small.features(), shallow);
        let deep = 3_072 + (63_488 + 45_568 + 32_000 + 9_088);
        assert_eq!(ResNetConfig { depth: 50, ..small }.features(), deep);
        assert_eq!(ResNetConfig { channels: 5, ..small }.features(), 5 * shallow);
        // The standard stem halves twice: once before its own features, once after.
        let standard = ResNetConfig { stem: Stem::Standard, width_px: 128, height_px: 128, ..small };
        assert_eq!(standard.features(), shallow + 3 * (64 * 64 - 32 * 32));
    }

    #[test]
    fn what_is_no_residual_network_is_refused() {
        let good = ResNetConfig::default();
        assert_eq!(good.check(), Ok(()));
        for bad in [
            ResNetConfig { depth: 19, ..good },
            ResNetConfig { channels: 0, ..good },
            ResNetConfig { channels: 1 << 40, ..good },
            ResNetConfig { width_px: 8, ..good },
            ResNetConfig { height_px: 100_000, ..good },
        ] {
            assert!(bad.check().is_err(), "{bad:?}");
        }
    }
}
