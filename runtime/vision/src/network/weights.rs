//! Networks on disk: safetensors with torchvision's names, and what the network is as JSON in the metadata.

use std::collections::HashMap;
use std::fs::File;
use std::io::{Read, Write};
use std::path::Path;

use safetensors::tensor::{Dtype, TensorView};
use safetensors::{SafeTensors, serialize};
use serde::{Deserialize, Serialize};

use super::adam::Adam;
use super::architecture::Slot;
use super::error::NetworkError;
use super::images::SourceRecord;
use super::pose_head::PoseHead;
use super::tensors::Values;
use super::train::{Course, TrainConfig};

/// Of the metadata.
pub(crate) const FORMAT: u32 = 2;
/// Largest file that is read.
const FILE_BYTES: u64 = 2 << 30;
const RECORD: &str = "mpgx";
const LOG_VARIANCES: &str = "loss.log_variances";

/// What a network is and how it came to be.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NetworkRecord {
    pub format: u32,
    pub training: TrainConfig,
    pub head: PoseHead,
    pub source: SourceRecord,
    /// Steps done.
    pub step: u64,
    pub course: Course,
}

impl NetworkRecord {
    /// A hash of the world, its trials or recordings, and of how was trained.
    pub fn hash(&self) -> String {
        let of = serde_json::to_vec(&(&self.training, &self.head, &self.source)).unwrap_or_default();
        blake3::hash(&of).to_hex().to_string()
    }
}

/// A network as numbers.
#[derive(Clone, Debug, PartialEq)]
pub struct Weights {
    pub record: NetworkRecord,
    pub(crate) values: Values,
    /// Of the parts of the loss.
    pub(crate) log_variances: Vec<f32>,
    /// While its training is not done.
    pub(crate) adam: Option<Adam>,
}

impl Weights {
    /// How many numbers are learnt.
    pub fn parameters(&self) -> u64 {
        let layout = self.record.training.network.layout(self.record.head.numbers());
        layout.iter().filter(|slot| slot.trained()).map(|slot| slot.count() as u64).sum()
    }

    /// Writes the file whole or not at all.
    pub fn write(&self, path: &Path) -> Result<(), NetworkError> {
        let io = |source| NetworkError::Io { path: path.into(), source };
        let bytes = self.to_bytes()?;
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let unfinished = path.with_added_extension("tmp");
        let mut file = File::create(&unfinished).map_err(io)?;
        file.write_all(&bytes).and_then(|()| file.sync_all()).map_err(io)?;
        std::fs::rename(&unfinished, path).map_err(io)?;
        File::open(folder).and_then(|folder| folder.sync_all()).map_err(io)
    }

    /// As a safetensors file.
    pub fn to_bytes(&self) -> Result<Vec<u8>, NetworkError> {
        let bad = |why: String| NetworkError::BadWeights { file: "it".into(), why };
        let record = serde_json::to_string(&self.record).map_err(|error| bad(error.to_string()))?;
        let bytes: Vec<(String, Vec<usize>, Vec<u8>)> =
            self.named().into_iter().map(|(name, shape, values)| (name, shape, le_bytes(values))).collect();
        let views = bytes.iter().map(|(name, shape, bytes)| {
            TensorView::new(Dtype::F32, shape.clone(), bytes).map(|view| (name.as_str(), view))
        });
        let views = views.collect::<Result<Vec<_>, _>>().map_err(|error| bad(error.to_string()))?;
        let metadata = HashMap::from([(RECORD.to_string(), record)]);
        serialize(views, Some(metadata)).map_err(|error| bad(error.to_string()))
    }

    /// Reads a network. What does not fit the architecture that the metadata names is refused before the network is made.
    pub fn read(path: &Path) -> Result<Weights, NetworkError> {
        let io = |source| NetworkError::Io { path: path.into(), source };
        let mut bytes = Vec::new();
        let file = File::open(path).map_err(io)?;
        file.take(FILE_BYTES + 1).read_to_end(&mut bytes).map_err(io)?;
        Weights::from_bytes(&bytes, &path.display().to_string())
    }

    /// [`Weights::read`] of what is in memory; `file` is its name in errors.
    pub fn from_bytes(bytes: &[u8], file: &str) -> Result<Weights, NetworkError> {
        Weights::parse(bytes).map_err(|why| NetworkError::BadWeights { file: file.into(), why })
    }

    fn parse(bytes: &[u8]) -> Result<Weights, String> {
        if bytes.len() as u64 > FILE_BYTES {
            return Err(format!("it has more than {FILE_BYTES} bytes"));
        }
        let tensors = SafeTensors::deserialize(bytes).map_err(|error| error.to_string())?;
        let (_, metadata) = SafeTensors::read_metadata(bytes).map_err(|error| error.to_string())?;
        let record = metadata.metadata().as_ref().and_then(|metadata| metadata.get(RECORD));
        let record = record.ok_or_else(|| format!("its metadata has no `{RECORD}`"))?;
        let record: NetworkRecord =
            serde_json::from_str(record).map_err(|error| format!("its metadata: {error}"))?;
        if record.format != FORMAT {
            return Err(format!("its format is {}, this program reads {FORMAT}", record.format));
        }
        record.training.check().map_err(|error| error.to_string())?;
        if !record.head.is_sound() {
            return Err("the ranges of its outputs are no ranges".into());
        }

        let layout = record.training.network.layout(record.head.numbers());
        let done = record.step >= record.training.steps;
        let mut left = tensors.len();
        let mut list = |name: &str, shape: &[usize]| {
            left = left.saturating_sub(1);
            floats(&tensors, name, shape)
        };
        let values = layout.iter().map(|slot| list(&slot.name, &slot.shape)).collect::<Result<_, _>>()?;
        let log_variances = list(LOG_VARIANCES, &[3])?;
        let adam = if done {
            None
        } else {
            let mut moments = |what: &str| {
                let slots = moment_slots(&layout);
                slots.map(|(name, shape)| list(&format!("adam.{what}.{name}"), &shape)).collect()
            };
            let (mean, square): (Result<Values, String>, Result<Values, String>) =
                (moments("mean"), moments("square"));
            Some(Adam { step: record.step, mean: mean?, square: square? })
        };
        if left > 0 {
            return Err(format!("{left} of its tensors do not belong to its architecture"));
        }
        Ok(Weights { record, values, log_variances, adam })
    }

    /// Every tensor of the file.
    fn named(&self) -> Vec<(String, Vec<usize>, &[f32])> {
        let layout = self.record.training.network.layout(self.record.head.numbers());
        let values = layout.iter().zip(&self.values);
        let mut named: Vec<(String, Vec<usize>, &[f32])> =
            values.map(|(slot, values)| (slot.name.clone(), slot.shape.clone(), values.as_slice())).collect();
        named.push((LOG_VARIANCES.into(), vec![3], &self.log_variances));
        for (what, lists) in
            self.adam.iter().flat_map(|adam| [("mean", &adam.mean), ("square", &adam.square)])
        {
            let slots = moment_slots(&layout).zip(lists);
            named.extend(
                slots.map(|((name, shape), list)| (format!("adam.{what}.{name}"), shape, list.as_slice())),
            );
        }
        named
    }
}

/// Names and shapes of Adam's lists; they are empty for running statistics.
fn moment_slots(layout: &[Slot]) -> impl Iterator<Item = (String, Vec<usize>)> {
    let shape = |slot: &Slot| if slot.trained() { slot.shape.clone() } else { vec![0] };
    let slots = layout.iter().map(move |slot| (slot.name.clone(), shape(slot)));
    slots.chain([(LOG_VARIANCES.to_string(), vec![3])])
}

/// The finite numbers of a tensor of this shape.
fn floats(tensors: &SafeTensors<'_>, name: &str, shape: &[usize]) -> Result<Vec<f32>, String> {
    let view = tensors.tensor(name).map_err(|_| format!("`{name}` is missing"))?;
    if view.dtype() != Dtype::F32 || view.shape() != shape {
        let found = (view.dtype(), view.shape());
        return Err(format!("`{name}` is {:?} {:?}; it must be F32 {shape:?}", found.0, found.1));
    }
    let (numbers, _) = view.data().as_chunks::<4>();
    let numbers: Vec<f32> = numbers.iter().map(|&bytes| f32::from_le_bytes(bytes)).collect();
    if numbers.iter().all(|number| number.is_finite()) {
        Ok(numbers)
    } else {
        Err(format!("`{name}` holds what is not a finite number"))
    }
}

fn le_bytes(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|value| value.to_le_bytes()).collect()
}
