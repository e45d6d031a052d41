//! A disk in memory that fails, tears and forgets on demand.
//!
//! It keeps apart what was written and what is durable. A crash may lose, keep or tear whatever was not
//! synced: the content of each file by itself, and each change of a name by itself, in any order. With the name of
//! a folder all is lost that lies in it. The names of folders end with `/`.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use super::{Operation, Storage, StorageError, parent};

/// What goes wrong at a chosen operation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// No space left from this operation on, until [`SimulatedDisk::repair`]; half of the write is done.
    Full,
    /// No space left, this once.
    FullOnce,
    /// The device fails from this operation on, until [`SimulatedDisk::repair`].
    Broken,
    /// The device fails this once.
    BrokenOnce,
    /// The machine stops: half of the write is done, then nothing works.
    Crash,
}

/// What a crash does to what was not synced.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Crash {
    /// All of it is lost.
    Forget,
    /// All of it is kept.
    Keep,
    /// Each file and each name has its own fate: lost, kept, torn, filled with zeros.
    Mixed(u64),
}

impl Crash {
    /// A few of each kind, for tests.
    pub const SAMPLE: [Crash; 6] =
        [Crash::Forget, Crash::Keep, Crash::Mixed(1), Crash::Mixed(2), Crash::Mixed(3), Crash::Mixed(4)];
}

/// Files in memory; every operation is counted.
#[derive(Debug, Default)]
pub struct SimulatedDisk {
    state: Mutex<State>,
}

type FileId = u64;

#[derive(Clone, Debug, Default)]
struct State {
    files: BTreeMap<FileId, Content>,
    names: BTreeMap<String, FileId>,
    durable_names: BTreeMap<String, FileId>,
    /// Changes of names that are not durable yet; each is one step of the file system's journal.
    pending: Vec<Vec<(String, Option<FileId>)>>,
    next_file: FileId,
    operations: u64,
    fault: Option<(u64, Fault)>,
}

#[derive(Clone, Debug, Default)]
struct Content {
    written: Arc<Vec<u8>>,
    durable: Arc<Vec<u8>>,
}

impl SimulatedDisk {
    /// Operations done so far.
    pub fn operations(&self) -> u64 {
        self.lock().operations
    }

    /// Makes the operation of that number (counted from 0) go wrong.
    pub fn inject(&self, operation: u64, fault: Fault) {
        self.lock().fault = Some((operation, fault));
    }

    /// Nothing goes wrong from now on.
    pub fn repair(&self) {
        self.lock().fault = None;
    }

    /// An independent copy; contents are shared until one of the two writes.
    pub fn fork(&self) -> SimulatedDisk {
        SimulatedDisk { state: Mutex::new(self.lock().clone()) }
    }

    /// The disk as it is found after the machine has stopped now and started again.
    pub fn after_crash(&self, crash: Crash) -> SimulatedDisk {
        let state = self.lock();
        let mut dice = Dice(match crash {
            Crash::Mixed(seed) => seed,
            _ => 0,
        });
        let mut names = state.durable_names.clone();
        for step in &state.pending {
            let kept = match crash {
                Crash::Forget => false,
                Crash::Keep => true,
                Crash::Mixed(_) => dice.below(2) == 0,
            };
            for (name, file) in step.iter().filter(|_| kept) {
                match file {
                    Some(file) => names.insert(name.clone(), *file),
                    None => names.remove(name),
                };
            }
        }
        let all = names.clone();
        names.retain(|name, _| above(name).all(|folder| all.contains_key(folder)));
        let mut files = BTreeMap::new();
        for file in names.values() {
            let Some(Content { written, durable }) = state.files.get(file) else { continue };
            let found = match crash {
                _ if written == durable => durable.clone(),
                Crash::Forget => durable.clone(),
                Crash::Keep => written.clone(),
                Crash::Mixed(_) => torn(written, durable, &mut dice),
            };
            files.insert(*file, Content { written: found.clone(), durable: found });
        }
        let next_file = state.next_file;
        let durable_names = names.clone();
        SimulatedDisk {
            state: Mutex::new(State { files, names, durable_names, next_file, ..State::default() }),
        }
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Counts an operation and lets it fail if it must.
    fn begin(&self, operation: Operation, path: &str) -> Result<MutexGuard<'_, State>, StorageError> {
        let mut state = self.lock();
        match state.count(operation, path, 0) {
            Some(error) => Err(error),
            None => Ok(state),
        }
    }
}

/// The folders that a path lies in, as they are named here.
fn above(path: &str) -> impl Iterator<Item = &str> {
    let last = path.len().saturating_sub(1);
    path.match_indices('/').filter(move |(at, _)| *at < last).filter_map(|(at, _)| path.get(..=at))
}

fn broken(operation: Operation, path: String, cause: &str) -> StorageError {
    StorageError::Failed { operation, path, cause: cause.to_string() }
}

/// One of the ways in which blocks that were not synced reach the disk; what was durable and is unchanged stays.
fn torn(written: &Arc<Vec<u8>>, durable: &Arc<Vec<u8>>, dice: &mut Dice) -> Arc<Vec<u8>> {
    let unchanged = written.iter().zip(durable.iter()).take_while(|(a, b)| a == b).count();
    let cut = unchanged + dice.below((written.len() - unchanged) as u64 + 1) as usize;
    let (head, tail) = written.split_at(cut);
    match dice.below(5) {
        0 => durable.clone(),
        1 => written.clone(),
        2 => Arc::new(head.to_vec()),
        3 => Arc::new([head, &vec![0; tail.len()]].concat()),
        _ => Arc::new([head, durable.get(cut..).unwrap_or_default()].concat()),
    }
}

impl State {
    /// Counts an operation; its error, if it must fail. Only what takes space fails on a full disk.
    fn count(&mut self, operation: Operation, path: &str, needed: usize) -> Option<StorageError> {
        let number = self.operations;
        self.operations += 1;
        let (at, fault) = self.fault?;
        let now = match fault {
            Fault::FullOnce | Fault::BrokenOnce => number == at,
            Fault::Full | Fault::Broken | Fault::Crash => number >= at,
        };
        let takes_space = matches!(operation, Operation::Write | Operation::Sync | Operation::CreateFolder);
        let path = path.to_string();
        match fault {
            _ if !now => None,
            Fault::Full | Fault::FullOnce => {
                takes_space.then_some(StorageError::Full { operation, path, needed: needed as u64 })
            }
            Fault::Broken | Fault::BrokenOnce => Some(broken(operation, path, "input/output error")),
            Fault::Crash => Some(broken(operation, path, "the machine has stopped")),
        }
    }

    /// Whether a crash happened at an operation before the present one.
    fn has_stopped_before(&self) -> bool {
        self.fault.is_some_and(|(at, fault)| fault == Fault::Crash && self.operations > at + 1)
    }

    fn file_of(&self, operation: Operation, path: &str) -> Result<FileId, StorageError> {
        let missing = || StorageError::Missing { operation, path: path.to_string() };
        self.names.get(path).copied().ok_or_else(missing)
    }

    fn name(&mut self, step: Vec<(String, Option<FileId>)>) {
        for (name, file) in &step {
            match file {
                Some(file) => self.names.insert(name.clone(), *file),
                None => self.names.remove(name),
            };
        }
        self.pending.push(step);
    }

    fn has_folder(&self, operation: Operation, path: &str) -> Result<(), StorageError> {
        match above(path).all(|folder| self.names.contains_key(folder)) {
            true => Ok(()),
            false => Err(StorageError::Missing { operation, path: path.to_string() }),
        }
    }

    fn create(&mut self, path: &str, content: Content) -> FileId {
        let file = self.next_file;
        self.next_file += 1;
        self.files.insert(file, content);
        self.name(vec![(path.to_string(), Some(file))]);
        file
    }

    fn write(&mut self, path: &str, at: u64, bytes: &[u8]) -> Result<(), StorageError> {
        let file = match self.names.get(path) {
            Some(file) => *file,
            None if at == 0 => {
                self.has_folder(Operation::Write, path)?;
                self.create(path, Content::default())
            }
            None => {
                return Err(StorageError::Missing { operation: Operation::Write, path: path.to_string() });
            }
        };
        let content = self.files.entry(file).or_default();
        match content.written.get(..at as usize) {
            None => {
                Err(broken(Operation::Write, path.to_string(), &format!("it is shorter than {at} bytes")))
            }
            Some(kept) => {
                content.written = Arc::new([kept, bytes].concat());
                Ok(())
            }
        }
    }
}

impl Storage for SimulatedDisk {
    fn read(&self, path: &str) -> Result<Vec<u8>, StorageError> {
        let state = self.begin(Operation::Read, path)?;
        let file = state.file_of(Operation::Read, path)?;
        Ok(state.files.get(&file).map(|content| content.written.to_vec()).unwrap_or_default())
    }

    fn list(&self, folder: &str) -> Result<Vec<String>, StorageError> {
        let state = self.begin(Operation::List, folder)?;
        let prefix = if folder.is_empty() { String::new() } else { format!("{folder}/") };
        let files = state.names.keys().filter(|name| !name.ends_with('/'));
        Ok(files.filter_map(|name| name.strip_prefix(&prefix)).map(str::to_string).collect())
    }

    fn make_folder(&self, folder: &str) -> Result<bool, StorageError> {
        let mut state = self.begin(Operation::CreateFolder, folder)?;
        let name = format!("{folder}/");
        if folder.is_empty() || state.names.contains_key(&name) {
            return Ok(false);
        }
        state.has_folder(Operation::CreateFolder, &name)?;
        state.create(&name, Content::default());
        Ok(true)
    }

    fn write(&self, path: &str, at: u64, bytes: &[u8]) -> Result<(), StorageError> {
        let mut state = self.lock();
        let Some(error) = state.count(Operation::Write, path, bytes.len()) else {
            return state.write(path, at, bytes);
        };
        if !state.has_stopped_before() {
            state.write(path, at, bytes.get(..bytes.len() / 2).unwrap_or_default())?;
        }
        Err(error)
    }

    fn sync(&self, path: &str) -> Result<(), StorageError> {
        let mut state = self.begin(Operation::Sync, path)?;
        let file = state.file_of(Operation::Sync, path)?;
        if let Some(content) = state.files.get_mut(&file) {
            content.durable = content.written.clone();
        }
        Ok(())
    }

    fn sync_folder(&self, folder: &str) -> Result<(), StorageError> {
        let mut state = self.begin(Operation::Sync, folder)?;
        let here = |step: &[(String, Option<FileId>)]| step.iter().any(|(name, _)| parent(name) == folder);
        let (durable, pending): (Vec<_>, Vec<_>) =
            std::mem::take(&mut state.pending).into_iter().partition(|step| here(step));
        state.pending = pending;
        for (name, file) in durable.into_iter().flatten() {
            match file {
                Some(file) => state.durable_names.insert(name, file),
                None => state.durable_names.remove(&name),
            };
        }
        Ok(())
    }

    fn rename(&self, from: &str, to: &str) -> Result<(), StorageError> {
        let mut state = self.begin(Operation::Rename, from)?;
        let file = state.file_of(Operation::Rename, from)?;
        state.name(vec![(from.to_string(), None), (to.to_string(), Some(file))]);
        Ok(())
    }

    fn create_new(&self, path: &str, bytes: &[u8]) -> Result<bool, StorageError> {
        let mut state = self.begin(Operation::Write, path)?;
        if state.names.contains_key(path) {
            return Ok(false);
        }
        state.has_folder(Operation::Write, path)?;
        let bytes = Arc::new(bytes.to_vec());
        state.create(path, Content { written: bytes.clone(), durable: bytes });
        Ok(true)
    }

    fn remove(&self, path: &str) -> Result<(), StorageError> {
        let mut state = self.begin(Operation::Remove, path)?;
        state.file_of(Operation::Remove, path)?;
        state.name(vec![(path.to_string(), None)]);
        Ok(())
    }
}

/// SplitMix64.
struct Dice(u64);

impl Dice {
    fn below(&mut self, n: u64) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut x = self.0;
        x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (x ^ (x >> 31)) % n.max(1)
    }
}
