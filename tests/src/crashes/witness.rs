//! Storages around another: one forgets an fsync, one writes down what was promised.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

use mpgx_study::storage::{SimulatedDisk, Storage, StorageError};

/// Hands all operations on but these.
macro_rules! through {
    ($($name:ident($($argument:ident: $kind:ty),*) -> $gives:ty;)*) => {$(
        fn $name(&self, $($argument: $kind),*) -> Result<$gives, StorageError> {
            self.disk.$name($($argument),*)
        }
    )*};
}

/// A disk whose fsync number `forgotten` does nothing.
pub struct Forgetful<'a> {
    disk: &'a SimulatedDisk,
    forgotten: Option<u64>,
    syncs: AtomicU64,
}

impl<'a> Forgetful<'a> {
    pub fn new(disk: &'a SimulatedDisk, forgotten: Option<u64>) -> Forgetful<'a> {
        Forgetful { disk, forgotten, syncs: AtomicU64::new(0) }
    }

    pub fn syncs(&self) -> u64 {
        self.syncs.load(Ordering::Relaxed)
    }

    fn forgets(&self) -> bool {
        Some(self.syncs.fetch_add(1, Ordering::Relaxed)) == self.forgotten
    }
}

impl Storage for Forgetful<'_> {
    through! {
        read(path: &str) -> Vec<u8>;
        list(folder: &str) -> Vec<String>;
        make_folder(folder: &str) -> bool;
        write(path: &str, at: u64, bytes: &[u8]) -> ();
        rename(from: &str, to: &str) -> ();
        create_new(path: &str, bytes: &[u8]) -> bool;
        remove(path: &str) -> ();
    }

    fn sync(&self, path: &str) -> Result<(), StorageError> {
        if self.forgets() { Ok(()) } else { self.disk.sync(path) }
    }

    fn sync_folder(&self, folder: &str) -> Result<(), StorageError> {
        if self.forgets() { Ok(()) } else { self.disk.sync_folder(folder) }
    }
}

/// What each file must hold after a crash.
#[derive(Debug, Default)]
pub struct Promises(Mutex<BTreeMap<String, Promise>>);

#[derive(Clone, Debug)]
struct Promise {
    /// What was in it when a call returned; `None`: perhaps nothing.
    kept: Option<Vec<u8>>,
    /// A log may hold more than what was promised.
    log: bool,
    /// What a call that has not returned wanted in it.
    wanted: Vec<Vec<u8>>,
}

impl Clone for Promises {
    fn clone(&self) -> Promises {
        Promises(Mutex::new(self.lock().clone()))
    }
}

impl Promises {
    fn lock(&self) -> MutexGuard<'_, BTreeMap<String, Promise>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Holds them against what is found on a disk, which is what they are from now on.
    pub fn hold(&mut self, disk: &SimulatedDisk) -> Result<(), String> {
        for (path, promise) in self.lock().iter_mut() {
            let found = disk.read_if_there(path).map_err(|error| error.to_string())?;
            let kept = match (&found, &promise.kept) {
                (found, None) => {
                    found.is_none()
                        || promise.log
                        || promise.wanted.iter().any(|it| Some(it) == found.as_ref())
                }
                (Some(found), Some(kept)) if promise.log => found.starts_with(kept),
                (Some(found), Some(kept)) => found == kept || promise.wanted.contains(found),
                (None, Some(_)) => false,
            };
            if !kept {
                let length = found.map(|found| found.len());
                return Err(format!("`{path}` is not what was written: {length:?} bytes"));
            }
            if !promise.log {
                *promise = Promise { kept: found, log: false, wanted: Vec::new() };
            }
        }
        Ok(())
    }
}

/// Writes down what the functions promise that stand on single operations.
pub struct Witness<'a> {
    pub disk: &'a dyn Storage,
    pub promises: &'a Promises,
}

impl Storage for Witness<'_> {
    through! {
        read(path: &str) -> Vec<u8>;
        list(folder: &str) -> Vec<String>;
        make_folder(folder: &str) -> bool;
        write(path: &str, at: u64, bytes: &[u8]) -> ();
        sync(path: &str) -> ();
        sync_folder(folder: &str) -> ();
        create_new(path: &str, bytes: &[u8]) -> bool;
    }

    fn rename(&self, from: &str, to: &str) -> Result<(), StorageError> {
        self.promises.lock().remove(from);
        self.promises.lock().remove(to);
        self.disk.rename(from, to)
    }

    fn remove(&self, path: &str) -> Result<(), StorageError> {
        self.promises.lock().remove(path);
        self.disk.remove(path)
    }

    fn write_atomic(&self, path: &str, bytes: &[u8]) -> Result<(), StorageError> {
        let nothing = Promise { kept: None, log: false, wanted: Vec::new() };
        self.promises.lock().entry(path.into()).or_insert(nothing).wanted.push(bytes.to_vec());
        self.disk.write_atomic(path, bytes)?;
        let promise = Promise { kept: Some(bytes.to_vec()), log: false, wanted: Vec::new() };
        self.promises.lock().insert(path.into(), promise);
        Ok(())
    }

    fn append(&self, path: &str, at: u64, bytes: &[u8]) -> Result<u64, StorageError> {
        let mut kept = self.promises.lock().remove(path).and_then(|promise| promise.kept).unwrap_or_default();
        kept.truncate(at as usize);
        let log = |kept: &[u8]| Promise { kept: Some(kept.to_vec()), log: true, wanted: Vec::new() };
        if !kept.is_empty() {
            self.promises.lock().insert(path.into(), log(&kept));
        }
        let length = self.disk.append(path, at, bytes)?;
        kept.extend_from_slice(bytes);
        if kept.len() as u64 == length {
            self.promises.lock().insert(path.into(), log(&kept));
        }
        Ok(length)
    }
}
