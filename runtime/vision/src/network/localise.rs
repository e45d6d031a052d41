//! A trained network at work: images in, poses out.

use burn::module::Module;
use burn::tensor::{Tensor, TensorData};

use super::error::NetworkError;
use super::feed::{light, planes};
use super::images::fitted;
use super::pose_head::{Estimate, PoseHead};
use super::resnet::ResNet;
use super::tensors::{numbers, with_values};
use super::train::device;
use super::weights::Weights;
use crate::image::Image;

/// Images that go through the network at once.
const BATCH: usize = 32;

#[derive(Debug)]
pub struct Localiser {
    model: ResNet,
    head: PoseHead,
    width_px: usize,
    height_px: usize,
}

impl Localiser {
    pub fn new(weights: &Weights) -> Localiser {
        let config = &weights.record.training.network;
        let head = weights.record.head.clone();
        let layout = config.layout(head.numbers());
        let model = ResNet::new(config, head.numbers(), &device());
        let model = with_values(model, &layout, &weights.values, false).valid();
        Localiser { model, head, width_px: config.width_px, height_px: config.height_px }
    }

    /// Where each image was taken from; images of other sizes are brought to the network's.
    pub fn estimate(&self, images: &[Image]) -> Result<Vec<Estimate>, NetworkError> {
        let mut estimates = Vec::with_capacity(images.len());
        for images in images.chunks(BATCH) {
            let planes = images
                .iter()
                .flat_map(|image| planes(&light(&fitted(image, self.width_px, self.height_px).rgb)));
            let shape = [images.len(), 3, self.height_px, self.width_px];
            let pixels = TensorData::new(planes.collect::<Vec<f32>>(), shape);
            let told = numbers(self.model.forward(Tensor::from_data(pixels, &device())));
            if told.len() != images.len() * self.head.numbers() || !told.iter().all(|x| x.is_finite()) {
                return Err(NetworkError::NotFinite);
            }
            estimates.extend(told.chunks(self.head.numbers()).map(|row| self.head.decode(row)));
        }
        Ok(estimates)
    }
}
