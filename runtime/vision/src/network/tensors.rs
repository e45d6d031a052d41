//! The numbers of a network, in and out of its modules.

use burn::module::{Module, ModuleMapper, ModuleVisitor, Param};
use burn::tensor::{Gradients, Tensor, TensorData};

use super::architecture::Slot;
use super::resnet::ResNet;

/// One list of numbers for each tensor of a layout.
pub(crate) type Values = Vec<Vec<f32>>;

/// All tensors of a network, running statistics included.
pub(crate) fn values(model: &ResNet) -> Values {
    let mut reader = Reader(Vec::new());
    // A running statistic is behind by a step until the model is asked for a snapshot.
    model.valid().visit(&mut reader);
    reader.0
}

/// The network with other numbers: those that training changes, or all.
pub(crate) fn with_values(model: ResNet, layout: &[Slot], values: &Values, only_trained: bool) -> ResNet {
    model.map(&mut Writer { slots: layout.iter().zip(values), only_trained })
}

/// The gradient of every tensor; empty where there is none.
pub(crate) fn gradients(model: &ResNet, gradients: &mut Gradients) -> Values {
    let mut collector = Collector { gradients, found: Vec::new() };
    model.visit(&mut collector);
    collector.found
}

struct Reader(Values);

impl ModuleVisitor for Reader {
    fn visit_float<const D: usize>(&mut self, param: &Param<Tensor<D>>) {
        self.0.push(numbers(param.val()));
    }
}

struct Writer<'a, Slots: Iterator<Item = (&'a Slot, &'a Vec<f32>)>> {
    slots: Slots,
    only_trained: bool,
}

impl<'a, Slots: Iterator<Item = (&'a Slot, &'a Vec<f32>)>> ModuleMapper for Writer<'a, Slots> {
    fn map_float<const D: usize>(&mut self, param: Param<Tensor<D>>) -> Param<Tensor<D>> {
        let Some((slot, values)) = self.slots.next() else { return param };
        if self.only_trained && !slot.trained() {
            return param;
        }
        let (id, old, mapper) = param.consume();
        let data = TensorData::new(values.clone(), slot.shape.clone());
        let new = Tensor::from_data(data, &old.device()).set_require_grad(old.is_require_grad());
        Param::from_mapped_value(id, new, mapper)
    }
}

struct Collector<'a> {
    gradients: &'a mut Gradients,
    found: Values,
}

impl ModuleVisitor for Collector<'_> {
    fn visit_float<const D: usize>(&mut self, param: &Param<Tensor<D>>) {
        let gradient = param.val().grad_remove(self.gradients);
        self.found.push(gradient.map_or_else(Vec::new, numbers));
    }
}

/// The numbers of a tensor; a device that fails gives none, which the loss shows.
pub(crate) fn numbers<const D: usize>(tensor: Tensor<D>) -> Vec<f32> {
    tensor.try_into_vec_as::<f32>().unwrap_or_default()
}
