//! Against torchvision's networks: `tests/fixtures/make_resnets.py`.

use burn::tensor::{Device, Tensor, TensorData};
use safetensors::SafeTensors;

use crate::network::architecture::{ResNetConfig, Stem};
use crate::network::loss::{Weighting, losses, total};
use crate::network::pose_head::{Orientation, PoseHead};
use crate::network::resnet::ResNet;
use crate::network::tensors::{Values, gradients, numbers, values, with_values};
use crate::pose::{PoseQ, Quaternion};

const RESNETS: [(usize, usize, &[u8]); 3] = [
    (18, 2, include_bytes!("../../../tests/fixtures/resnet18.safetensors")),
    (34, 1, include_bytes!("../../../tests/fixtures/resnet34.safetensors")),
    (50, 1, include_bytes!("../../../tests/fixtures/resnet50.safetensors")),
];
const OUTPUTS: usize = 6;

fn of(tensors: &SafeTensors, name: &str) -> Vec<f32> {
    let view = tensors.tensor(name).unwrap();
    view.data().as_chunks::<4>().0.iter().map(|&bytes| f32::from_le_bytes(bytes)).collect()
}

fn tensor<const D: usize>(tensors: &SafeTensors, name: &str, device: &Device) -> Tensor<D> {
    let shape = tensors.tensor(name).unwrap().shape().to_vec();
    Tensor::from_data(TensorData::new(of(tensors, name), shape), device)
}

/// The network of a fixture, and its configuration.
fn network(depth: usize, channels: usize, tensors: &SafeTensors, device: &Device) -> (ResNetConfig, ResNet) {
    let config = ResNetConfig { depth, channels, stem: Stem::Standard, width_px: 32, height_px: 32 };
    let layout = config.layout(OUTPUTS);
    for slot in &layout {
        assert_eq!(tensors.tensor(&format!("weights.{}", slot.name)).unwrap().shape(), slot.shape);
    }
    let values: Values = layout.iter().map(|slot| of(tensors, &format!("weights.{}", slot.name))).collect();
    let model = with_values(ResNet::new(&config, OUTPUTS, device), &layout, &values, false);
    (config, model)
}

/// Within 10⁻⁴ of the largest number.
fn assert_near(found: &[f32], wanted: &[f32], what: &str) {
    assert_eq!(found.len(), wanted.len(), "{what}");
    let largest = wanted.iter().fold(1e-3f32, |most, value| most.max(value.abs()));
    for (found, wanted) in found.iter().zip(wanted) {
        assert!((found - wanted).abs() <= 1e-4 * largest, "{what}: {found}, not {wanted}");
    }
}

#[test]
fn every_stage_makes_what_torchvisions_makes() {
    let images = SafeTensors::deserialize(RESNETS[0].2).unwrap();
    for (depth, channels, bytes) in RESNETS {
        let tensors = SafeTensors::deserialize(bytes).unwrap();
        let device = Device::flex();
        let (_, model) = network(depth, channels, &tensors, &device);
        let check = |found: Tensor<4>, part: &str| {
            assert_near(&numbers(found), &of(&tensors, &format!("after.{part}")), &format!("{depth} {part}"));
        };
        let image: Tensor<4> = tensor(&images, "image", &device);
        let mut x = model.stem(image.clone());
        check(x.clone(), "stem");
        for stage in 0..4 {
            x = model.stage(stage, x);
            check(x.clone(), &format!("layer{}", stage + 1));
        }
        let outputs = numbers(model.forward(image));
        assert_near(&outputs, &of(&tensors, "after.outputs"), &format!("{depth} outputs"));
    }
}

fn head() -> PoseHead {
    PoseHead {
        orientation: Orientation::Heading,
        bins: 1,
        x_m: [-1.0, 1.0],
        y_m: [-1.0, 1.0],
        mount: PoseQ { position_m: [0.0; 3], quaternion: Quaternion::IDENTITY },
        landmarks_m: vec![[0.0; 2]; 2],
    }
}

#[test]
fn a_step_has_the_losses_gradients_and_statistics_of_torch() {
    let (depth, channels, bytes) = RESNETS[0];
    let tensors = SafeTensors::deserialize(bytes).unwrap();
    let device = Device::flex().autodiff();
    let (config, model) = network(depth, channels, &tensors, &device);
    let outputs = model.forward(tensor(&tensors, "image", &device));
    let (errors, parts) = losses(&outputs, &tensor(&tensors, "target", &device), &head());
    let found = errors.map(|loss| numbers(loss.unwrap().detach())[0]);
    assert_near(&found, &of(&tensors, "losses"), "losses");

    let fixed = Weighting::Fixed { position: 1.0, orientation: 0.5, landmarks: 0.3 };
    let slopes = gradients(&model, &mut total(&parts, fixed.weights(&[])).unwrap().backward());
    let layout = config.layout(OUTPUTS);
    let mut compared = 0;
    for (slot, slope) in layout.iter().zip(&slopes) {
        assert_eq!(slope.is_empty(), !slot.trained(), "{}", slot.name);
        if tensors.tensor(&format!("gradient.{}", slot.name)).is_ok() {
            assert_near(slope, &of(&tensors, &format!("gradient.{}", slot.name)), &slot.name);
            compared += 1;
        }
    }
    assert_eq!(compared, 7);
    for (slot, now) in layout.iter().zip(values(&model)) {
        if slot.name.starts_with("bn1.running") {
            let before = of(&tensors, &format!("weights.{}", slot.name));
            let mut wanted = of(&tensors, &format!("after.{}", slot.name));
            if slot.name.ends_with("var") {
                // Torch divides by one less than the 2 × 16 × 16 numbers of a channel, burn by all of them.
                for (wanted, before) in wanted.iter_mut().zip(before) {
                    *wanted = 0.9 * before + (*wanted - 0.9 * before) * 511.0 / 512.0;
                }
            }
            assert_near(&now, &wanted, &slot.name);
        }
    }
}

#[test]
fn learnt_weights_have_the_gradients_of_torch() {
    let tensors = SafeTensors::deserialize(RESNETS[0].2).unwrap();
    let losses = of(&tensors, "losses");
    let losses = [losses[0], losses[1], losses[2]].map(f64::from);
    let log_variances = [0.2, -0.4, 0.1];
    let slopes = Weighting::Learnt.gradient(&losses, &log_variances, &head());
    assert_near(&slopes, &of(&tensors, "log_variances.gradient"), "log-variances");
    let none = PoseHead { landmarks_m: Vec::new(), ..head() };
    assert_eq!(Weighting::Learnt.gradient(&losses, &log_variances, &none)[2], 0.0);
    assert_eq!(Weighting::default().gradient(&losses, &log_variances, &head()), [0.0; 3]);
}
