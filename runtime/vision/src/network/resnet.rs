//! Residual networks (He et al. 2015), layer by layer as torchvision's.

use burn::module::{Module, Param};
use burn::nn::conv::{Conv2d, Conv2dConfig};
use burn::nn::pool::{MaxPool2d, MaxPool2dConfig};
use burn::nn::{BatchNorm, BatchNormConfig, Initializer, PaddingConfig2d};
use burn::tensor::activation::relu;
use burn::tensor::module::adaptive_avg_pool2d;
use burn::tensor::{Device, Tensor};

use super::architecture::{BlockShape, ResNetConfig, Stem};

/// A network with all weights 0: `layout` of its configuration tells them in the order in which a visitor meets them.
#[derive(Module, Debug)]
pub struct ResNet {
    conv1: Conv2d,
    bn1: BatchNorm,
    pool: Option<MaxPool2d>,
    stages: Vec<Vec<Block>>,
    fc: Head,
}

/// Two or three convolutions beside a shortcut.
#[derive(Module, Debug)]
pub struct Block {
    conv1: Conv2d,
    bn1: BatchNorm,
    conv2: Conv2d,
    bn2: BatchNorm,
    third: Option<Norm>,
    downsample: Option<Norm>,
}

/// A convolution and what brings its channels to mean and variance.
#[derive(Module, Debug)]
pub struct Norm {
    conv: Conv2d,
    bn: BatchNorm,
}

/// The linear layer at the end, with weights `[outputs, inputs]` as torchvision's.
#[derive(Module, Debug)]
pub struct Head {
    weight: Param<Tensor<2>>,
    bias: Param<Tensor<1>>,
}

impl ResNet {
    pub fn new(config: &ResNetConfig, outputs: usize, device: &Device) -> ResNet {
        let (side, stride) = match config.stem {
            Stem::Standard => (7, 2),
            Stem::Small => (3, 1),
        };
        let stages = config.stages();
        let features = stages.iter().flatten().last().map_or(0, |block| block.to);
        let pool = MaxPool2dConfig::new([3, 3])
            .with_strides([2, 2])
            .with_padding(PaddingConfig2d::Explicit(1, 1, 1, 1));
        ResNet {
            conv1: convolution(3, config.channels, side, stride, device),
            bn1: BatchNormConfig::new(config.channels).init(device),
            pool: (config.stem == Stem::Standard).then(|| pool.init()),
            stages: stages
                .iter()
                .map(|stage| stage.iter().map(|shape| Block::new(shape, device)).collect())
                .collect(),
            fc: Head {
                weight: Initializer::Zeros.init([outputs, features], device),
                bias: Initializer::Zeros.init([outputs], device),
            },
        }
    }

    /// Outputs `[batch, outputs]` for images `[batch, 3, height, width]`.
    pub fn forward(&self, images: Tensor<4>) -> Tensor<2> {
        let features = (0..self.stages.len()).fold(self.stem(images), |x, stage| self.stage(stage, x));
        self.head(features)
    }

    pub(super) fn stem(&self, images: Tensor<4>) -> Tensor<4> {
        let x = relu(self.bn1.forward(self.conv1.forward(images)));
        match &self.pool {
            Some(pool) => pool.forward(x),
            None => x,
        }
    }

    pub(super) fn stage(&self, stage: usize, x: Tensor<4>) -> Tensor<4> {
        self.stages.get(stage).into_iter().flatten().fold(x, |x, block| block.forward(x))
    }

    pub(super) fn head(&self, features: Tensor<4>) -> Tensor<2> {
        let means = adaptive_avg_pool2d(features, [1, 1]).flatten::<2>(1, 3);
        means.matmul(self.fc.weight.val().transpose()) + self.fc.bias.val().unsqueeze()
    }
}

impl Block {
    fn new(shape: &BlockShape, device: &Device) -> Block {
        let &BlockShape { from, inner, to, stride, bottleneck } = shape;
        // A bottleneck strides in its middle convolution.
        let (side1, stride1, stride2) = if bottleneck { (1, 1, stride) } else { (3, stride, 1) };
        let norm = |from: usize, stride: usize| Norm {
            conv: convolution(from, to, 1, stride, device),
            bn: BatchNormConfig::new(to).init(device),
        };
        Block {
            conv1: convolution(from, inner, side1, stride1, device),
            bn1: BatchNormConfig::new(inner).init(device),
            conv2: convolution(inner, inner, 3, stride2, device),
            bn2: BatchNormConfig::new(inner).init(device),
            third: bottleneck.then(|| norm(inner, 1)),
            downsample: shape.resizes().then(|| norm(from, stride)),
        }
    }

    fn forward(&self, x: Tensor<4>) -> Tensor<4> {
        let shortcut = match &self.downsample {
            Some(downsample) => downsample.forward(x.clone()),
            None => x.clone(),
        };
        let x = relu(self.bn1.forward(self.conv1.forward(x)));
        let x = self.bn2.forward(self.conv2.forward(x));
        let x = match &self.third {
            Some(third) => third.forward(relu(x)),
            None => x,
        };
        relu(x + shortcut)
    }
}

impl Norm {
    fn forward(&self, x: Tensor<4>) -> Tensor<4> {
        self.bn.forward(self.conv.forward(x))
    }
}

/// Without bias, padded so that only the stride makes the image smaller.
fn convolution(from: usize, to: usize, side: usize, stride: usize, device: &Device) -> Conv2d {
    let edge = side / 2;
    Conv2dConfig::new([from, to], [side, side])
        .with_stride([stride, stride])
        .with_padding(PaddingConfig2d::Explicit(edge, edge, edge, edge))
        .with_bias(false)
        .with_initializer(Initializer::Zeros)
        .init(device)
}
