use std::collections::HashMap;
use std::ops::ControlFlow;

use safetensors::tensor::TensorView;
use safetensors::{Dtype, SafeTensors, serialize};
use serde_json::{Value, json};

use super::training::{noise, tiny};
use crate::network::{NetworkError, TrainConfig, Weights, train_to};

/// The bytes of a network in the midst of its training.
fn file() -> (tempfile::TempDir, Vec<u8>) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("net.safetensors");
    train_to(&TrainConfig { bins: 1, ..tiny() }, &noise(12), &path, 1, &mut |_| ControlFlow::Break(()))
        .unwrap();
    let bytes = std::fs::read(&path).unwrap();
    (folder, bytes)
}

type Tensors = Vec<(String, Dtype, Vec<usize>, Vec<u8>)>;

/// The file with other tensors and another record.
fn changed(bytes: &[u8], change: impl FnOnce(&mut Tensors, &mut Value)) -> Vec<u8> {
    let found = SafeTensors::deserialize(bytes).unwrap();
    let (_, metadata) = SafeTensors::read_metadata(bytes).unwrap();
    let mut record = serde_json::from_str(&metadata.metadata().as_ref().unwrap()["mpgx"]).unwrap();
    let mut tensors: Tensors = found
        .iter()
        .map(|(name, view)| (name.into(), view.dtype(), view.shape().to_vec(), view.data().to_vec()))
        .collect();
    change(&mut tensors, &mut record);
    let views = tensors
        .iter()
        .map(|(name, dtype, shape, data)| (name, TensorView::new(*dtype, shape.clone(), data).unwrap()));
    serialize(views, Some(HashMap::from([("mpgx".to_string(), record.to_string())]))).unwrap()
}

/// Why the bytes are refused.
fn why(bytes: &[u8]) -> String {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("net.safetensors");
    std::fs::write(&path, bytes).unwrap();
    let error = Weights::read(&path).unwrap_err();
    assert!(matches!(error, NetworkError::BadWeights { .. }), "{error}");
    let text = error.to_string();
    assert!(text.starts_with(&path.display().to_string()), "{text}");
    text
}

#[test]
fn what_is_written_is_read() {
    let (folder, bytes) = file();
    let weights = Weights::read(&folder.path().join("net.safetensors")).unwrap();
    assert!(weights.adam.is_some());
    let again = folder.path().join("again.safetensors");
    weights.write(&again).unwrap();
    assert!(std::fs::read(again).unwrap() == bytes);
    assert!(matches!(Weights::read(folder.path()), Err(NetworkError::Io { .. })));
    assert!(matches!(Weights::read(&folder.path().join("none")), Err(NetworkError::Io { .. })));
}

#[test]
fn cut_off_and_spoilt_files_are_refused() {
    let (_folder, bytes) = file();
    for end in [0, 1, 7, 8, 9, 100, bytes.len() / 2, bytes.len() - 1] {
        why(&bytes[..end]);
    }
    why(&[bytes.as_slice(), &[0]].concat());
    why(b"not a network at all");
    let mut long = bytes.clone();
    long[..8].fill(0xff);
    why(&long);
    let mut header = bytes.clone();
    header[8] = b'[';
    why(&header);
}

#[test]
fn tensors_that_do_not_fit_the_architecture_are_refused() {
    let (_folder, bytes) = file();
    let at = |tensors: &Tensors, name: &str| tensors.iter().position(|tensor| tensor.0 == name).unwrap();
    let missing = changed(&bytes, |tensors, _| drop(tensors.remove(at(tensors, "layer3.0.conv1.weight"))));
    assert!(why(&missing).ends_with("`layer3.0.conv1.weight` is missing"));
    let state = changed(&bytes, |tensors, _| drop(tensors.remove(at(tensors, "adam.square.fc.bias"))));
    assert!(why(&state).ends_with("`adam.square.fc.bias` is missing"));
    let more = changed(&bytes, |tensors, _| tensors.push(("more".into(), Dtype::F32, vec![1], vec![0; 4])));
    assert!(why(&more).ends_with("1 of its tensors do not belong to its architecture"));
    let turned = changed(&bytes, |tensors, _| {
        let at = at(tensors, "fc.weight");
        tensors[at].2.reverse();
    });
    assert!(why(&turned).ends_with("`fc.weight` is F32 [16, 4]; it must be F32 [4, 16]"));
    let other = changed(&bytes, |tensors, _| {
        let at = at(tensors, "fc.bias");
        tensors[at].1 = Dtype::I32;
    });
    assert!(why(&other).ends_with("`fc.bias` is I32 [4]; it must be F32 [4]"));
    let nan = changed(&bytes, |tensors, _| {
        let at = at(tensors, "fc.bias");
        tensors[at].3[..4].copy_from_slice(&f32::NAN.to_le_bytes());
    });
    assert!(why(&nan).ends_with("`fc.bias` holds what is not a finite number"));
}

#[test]
fn records_that_say_impossible_things_are_refused() {
    let (_folder, bytes) = file();
    let with = |pointer: &str, value: Value| {
        why(&changed(&bytes, |_, record| *record.pointer_mut(pointer).unwrap() = value))
    };
    assert!(with("/format", json!(1)).ends_with("its format is 1, this program reads 2"));
    assert!(with("/training/network/depth", json!(51)).ends_with("it must be 18, 34 or 50"));
    assert!(with("/training/network/channels", json!(1u64 << 50)).contains("1 to 256"));
    assert!(with("/training/network/channels", json!(256)).contains("must be F32"));
    assert!(with("/training/network/width_px", json!(u64::MAX)).contains("16 to 512"));
    assert!(with("/training/batch", json!(-1)).contains("its metadata"));
    assert!(with("/training/network/depth", json!(50)).contains("`layer1.0.conv1.weight` is F32"));
    for (pointer, value) in [
        ("/head/x_m", json!([1.0, 1.0])),
        ("/head/mount/quaternion/w", json!(7.0)),
        ("/head/landmarks_m", json!(vec![[0.0, 0.0]; 5000])),
    ] {
        assert!(with(pointer, value).ends_with("the ranges of its outputs are no ranges"), "{pointer}");
    }
    let bare = serialize(Vec::<(&str, TensorView)>::new(), None).unwrap();
    assert!(why(&bare).ends_with("its metadata has no `mpgx`"));
}
