use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use mpgx_lang::plan::{Extern, Localised, Localiser, Place, Plan, Setting};

use crate::estimate::{Todo, estimate, seconds};
use crate::progress::Progress;
use crate::record::LocaliserRecord;
use crate::run::{Options, Outcome, run};
use crate::sight::tests::seeing;
use crate::storage::{SimulatedDisk, Storage};
use crate::tests::sample;

/// The first protocol's follower is told its pose by a tiny network of three steps.
fn plan() -> Plan {
    let mut plan = seeing();
    plan.world.groups[1].camera.as_mut().unwrap().settings.insert("pixels".into(), Setting::Number(16.0));
    let seen = plan.world.clone();
    plan.world.localised.clear();
    plan.protocols.truncate(1);
    plan.protocols[0].world = Some(Box::new(seen));
    plan.learners.truncate(1);
    plan.seeds = 1;
    let number = |value| Setting::Number(value);
    let word = |word: &str| Setting::Word(word.into());
    let settings = [
        ("layers", number(18.0)),
        ("channels", number(2.0)),
        ("stem", word("standard")),
        ("orientation", word("heading")),
        ("bins", number(8.0)),
        ("weighting", word("fixed")),
        ("steps", number(3.0)),
        ("batch", number(4.0)),
        ("rate", number(1e-3)),
        ("seed", number(1.0)),
    ];
    let settings = settings.map(|(name, value)| (name.to_owned(), value)).into();
    let what = Extern { name: "resnet".into(), settings };
    plan.localisers = vec![Localiser { name: "eyes".into(), what, at: Place::default() }];
    plan
}

/// Interrupts the training of the network after its first step.
struct Impatient(Arc<AtomicBool>);

impl Progress for Impatient {
    fn localiser_step(&self, _: &str, _: u64, _: u64, _: f64) {
        self.0.store(true, Ordering::Relaxed);
    }
}

struct Finished(std::sync::Mutex<Vec<LocaliserRecord>>);

impl Progress for Finished {
    fn localiser_finished(&self, record: &LocaliserRecord) {
        self.0.lock().unwrap().push(record.clone());
    }
}

/// Trained in one go, in parts, and found ready: one hash. A network that was damaged is trained anew.
#[test]
fn a_network_is_trained_once_and_goes_on_where_it_was() {
    let (plan, whole) = (plan(), SimulatedDisk::default());
    let hash = sample::hash_of(&whole, &plan);
    let study = crate::load(&whole).unwrap();
    assert_eq!(Todo::of(&plan, None).unwrap().networks, [0]);
    assert!(Todo::of(&plan, Some(&study)).unwrap().networks.is_empty());
    let record = &study.localisers["eyes"];
    assert_eq!((record.images, record.steps.as_slice()), (12, [1, 2, 3].as_slice()));
    let told = study.records.values().filter_map(|record| record.protocols["random"].told.as_ref());
    assert!(told.clone().count() > 0 && told.clone().all(|told| told.position_error_m[0] > 0.0));

    let parts = SimulatedDisk::default();
    let options = sample::options();
    let impatient = Impatient(options.interrupt.clone());
    let outcome = run(&plan, &sample::source(), &parts, &options, &impatient).unwrap();
    assert!(matches!(outcome, Outcome::Interrupted { finished: 0, .. }));
    let options = Options { interrupt: Arc::default(), ..options };
    let finished = Finished(Default::default());
    let outcome = run(&plan, &sample::source(), &parts, &options, &finished);
    assert_eq!(sample::hash(outcome), hash);
    assert_eq!(finished.0.into_inner().unwrap().as_slice(), std::slice::from_ref(record));
    assert_eq!(sample::hash_of(&parts, &plan), hash);

    parts.write("localisers/eyes/network.safetensors", 9, b"damage").unwrap();
    assert_eq!(sample::hash_of(&parts, &plan), hash);
    let again = crate::load(&parts).unwrap();
    assert_eq!(again.localisers["eyes"], *record);
}

/// The other localiser is asked by nobody; a second group that looks has rooms of its own.
#[test]
fn the_forecast_counts_networks_and_rooms_that_are_needed() {
    let mut plan = plan();
    let memory = |plan: &Plan, todo: &Todo, threads| estimate(plan, todo, threads).unwrap().memory_bytes;
    let mut todo = Todo::of(&plan, None).unwrap();
    let room = super::size(&plan, 0).unwrap().room;
    let one = memory(&plan, &todo, 1);
    assert!(memory(&plan, &todo, 2) > one + 8.0 * room);
    plan.localisers.push(Localiser { name: "others".into(), ..plan.localisers[0].clone() });
    assert_eq!(Todo::of(&plan, None).unwrap().networks, [0]);
    todo.networks.clear();
    assert_eq!(one - memory(&plan, &todo, 1), super::size(&plan, 0).unwrap().memory);
    let world = plan.protocols[0].world.as_mut().unwrap();
    world.localised.push(Localised { group: 0, ..world.localised[0].clone() });
    let two = memory(&plan, &todo, 1) + super::size(&plan, 0).unwrap().memory;
    assert!((two - one - 8.0 * room).abs() < 1.0, "{two} and {one} with rooms of {room}");
}

#[test]
fn equal_networks_are_measured_once_and_those_that_are_trained_not_at_all() {
    let (mut plan, mut measured) = (plan(), Vec::new());
    let first = super::time(&plan, 0, false, &mut measured).unwrap();
    assert_eq!(super::time(&plan.clone(), 0, false, &mut measured).unwrap(), first);
    assert_eq!(measured.len(), 1);
    assert!(first.room > 0.0 && first.look > 0.0);
    // Rooms of one epoch, of the images that retrieval knows, and twice of those held out.
    assert!(first.training > (36.0 + 27.0 + 24.0) * first.room);
    let trained = super::time(&plan, 0, true, &mut measured).unwrap();
    assert_eq!((trained.training, trained.rendering), (0.0, 0.0));
    assert!(trained.room > 0.0 && trained.look > 0.0);
    let rest = (&plan, Todo::of(&plan, None).unwrap());
    assert!(seconds(&[rest], 2).unwrap() > first.room);
    // One step more than two passes over 3,600 images are.
    plan.localisers[0].what.settings.insert("steps".into(), Setting::Number(1801.0));
    let longer = super::time(&plan, 0, false, &mut measured).unwrap();
    assert!(first.rendering == 0.0 && longer.rendering > 36.0 * longer.room);
}
