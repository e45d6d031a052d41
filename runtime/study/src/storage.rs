//! All reading and writing goes through one trait: the real disk, and a simulated one that fails, tears and
//! forgets on demand.
//!
//! The trait's required functions are single operations of a file system. What makes a write safe (temporary
//! file, fsync, rename, fsync of the folder) is built on them here, once, so that the simulated disk tries
//! the same steps that the real one takes. Paths are relative, with `/`.

mod real;
mod simulated;

pub use real::RealDisk;
pub use simulated::{Crash, Fault, SimulatedDisk};

use thiserror::Error;

/// Why an operation on the disk failed.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum StorageError {
    #[error("cannot {operation} `{path}`: it is not there; run the study again to make it")]
    Missing { operation: Operation, path: String },
    #[error("cannot {operation} `{path}`: no space left for {needed} bytes; free some and run again")]
    Full { operation: Operation, path: String, needed: u64 },
    #[error("cannot {operation} `{path}`: not allowed; change its permissions or choose another folder")]
    Denied { operation: Operation, path: String },
    #[error("cannot {operation} `{path}`: {cause}; check the disk and run again")]
    Failed { operation: Operation, path: String, cause: String },
}

/// What was tried.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Operation {
    Read,
    List,
    CreateFolder,
    Write,
    Sync,
    Rename,
    Remove,
}

impl std::fmt::Display for Operation {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Operation::Read => "read",
            Operation::List => "list",
            Operation::CreateFolder => "make the folder",
            Operation::Write => "write",
            Operation::Sync => "flush",
            Operation::Rename => "rename",
            Operation::Remove => "remove",
        })
    }
}

/// A place for files, rooted at the folder of a study.
pub trait Storage: Sync {
    /// The whole content of a file.
    fn read(&self, path: &str) -> Result<Vec<u8>, StorageError>;

    /// Every file below a folder, as paths relative to it, sorted; none if the folder is missing.
    fn list(&self, folder: &str) -> Result<Vec<String>, StorageError>;

    /// Makes a folder in one that is there; false if it was there before. The root is made with all above it,
    /// durably; the name of any other folder is durable after [`Storage::sync_folder`] of the one above.
    fn make_folder(&self, folder: &str) -> Result<bool, StorageError>;

    /// Cuts a file to its first `at` bytes and writes `bytes` after them; not durable before [`Storage::sync`].
    /// With `at` 0 the file is made if it is missing; a file shorter than `at` is an error.
    fn write(&self, path: &str, at: u64, bytes: &[u8]) -> Result<(), StorageError>;

    /// Makes the content of a file durable.
    fn sync(&self, path: &str) -> Result<(), StorageError>;

    /// Makes the names in a folder durable.
    fn sync_folder(&self, folder: &str) -> Result<(), StorageError>;

    /// Gives a file another name in the same folder, at once; an old file of that name is gone.
    fn rename(&self, from: &str, to: &str) -> Result<(), StorageError>;

    /// Makes a file with its content, at once, unless there is one of that name: then false.
    fn create_new(&self, path: &str, bytes: &[u8]) -> Result<bool, StorageError>;

    fn remove(&self, path: &str) -> Result<(), StorageError>;

    /// Makes a folder and those above it, durably; nothing happens if it is there.
    fn create_folder(&self, folder: &str) -> Result<(), StorageError> {
        if !folder.is_empty() {
            self.create_folder(parent(folder))?;
        }
        if self.make_folder(folder)? && !folder.is_empty() {
            self.sync_folder(parent(folder))?;
        }
        Ok(())
    }

    /// The content of a file, or `None` if there is no such file.
    fn read_if_there(&self, path: &str) -> Result<Option<Vec<u8>>, StorageError> {
        match self.read(path) {
            Ok(bytes) => Ok(Some(bytes)),
            Err(StorageError::Missing { .. }) => Ok(None),
            Err(error) => Err(error),
        }
    }

    /// Replaces a file as a whole: after a crash at any moment it has the old content or the new, and the
    /// new once this has returned.
    fn write_atomic(&self, path: &str, bytes: &[u8]) -> Result<(), StorageError> {
        let temporary = format!("{path}.tmp");
        let done = self
            .write(&temporary, 0, bytes)
            .and_then(|()| self.sync(&temporary))
            .and_then(|()| self.rename(&temporary, path));
        if done.is_err() {
            let _ = self.remove(&temporary);
        }
        done.and_then(|()| self.sync_folder(parent(path)))
    }

    /// Writes `bytes` after the first `at` bytes of a file, durably, and gives the new length. Bytes that an
    /// earlier attempt left there are cut off.
    fn append(&self, path: &str, at: u64, bytes: &[u8]) -> Result<u64, StorageError> {
        self.write(path, at, bytes)?;
        self.sync(path)?;
        if at == 0 {
            self.sync_folder(parent(path))?;
        }
        Ok(at + bytes.len() as u64)
    }
}

/// The folder of a path; "" for the root.
fn parent(path: &str) -> &str {
    path.trim_end_matches('/').rsplit_once('/').map_or("", |(folder, _)| folder)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn in_a_folder(check: impl Fn(&dyn Storage)) {
        let folder = tempfile::tempdir().unwrap();
        check(&RealDisk::new(folder.path().join("new/study")));
        check(&SimulatedDisk::default());
    }

    #[test]
    fn both_disks_behave_alike() {
        in_a_folder(|disk| {
            assert_eq!(disk.read_if_there("a/b.bin").unwrap(), None);
            assert_eq!(disk.list("").unwrap(), Vec::<String>::new());
            disk.create_folder("a/c").unwrap();
            disk.create_folder("a/c").unwrap();
            disk.write_atomic("a/b.bin", b"one").unwrap();
            disk.write_atomic("a/b.bin", b"two!").unwrap();
            disk.write_atomic("a/c/d", b"").unwrap();
            assert_eq!(disk.read("a/b.bin").unwrap(), b"two!");
            assert_eq!(disk.list("a").unwrap(), ["b.bin", "c/d"]);
            assert_eq!(disk.append("a/log", 0, b"abc").unwrap(), 3);
            assert_eq!(disk.append("a/log", 3, b"def").unwrap(), 6);
            assert_eq!(disk.append("a/log", 2, b"X").unwrap(), 3);
            assert_eq!(disk.read("a/log").unwrap(), b"abX");
            assert!(disk.append("a/log", 9, b"gap").is_err());
            assert!(matches!(disk.append("a/none", 1, b"x"), Err(StorageError::Missing { .. })));
            assert!(disk.create_new("lock", b"me").unwrap());
            assert!(!disk.create_new("lock", b"you").unwrap());
            assert_eq!(disk.read("lock").unwrap(), b"me");
            disk.rename("lock", "key").unwrap();
            disk.remove("a/log").unwrap();
            assert!(matches!(disk.remove("a/log"), Err(StorageError::Missing { .. })));
            assert_eq!(disk.list("").unwrap(), ["a/b.bin", "a/c/d", "key"]);
        });
    }

    /// At every operation, in every way: the old content or the new, and the new once the write has returned.
    /// Seen to fail when the temporary file or the folder is not flushed.
    #[test]
    fn an_atomic_write_survives_any_crash() {
        let (old, new) = (vec![1; 100], vec![2; 300]);
        let before = SimulatedDisk::default();
        before.write_atomic("f", &old).unwrap();
        let start = before.operations();
        for crash_at in start..start + 6 {
            for crash in Crash::SAMPLE {
                let disk = before.fork();
                disk.inject(crash_at, Fault::Crash);
                let written = disk.write_atomic("f", &new).is_ok();
                let found = disk.after_crash(crash).read("f").unwrap();
                assert!(found == new || (found == old && !written), "operation {crash_at}, {crash:?}");
            }
        }
    }

    /// Seen to fail when what is appended is not flushed.
    #[test]
    fn a_crash_spares_what_append_has_returned() {
        for crash_at in 0..9 {
            for crash in Crash::SAMPLE {
                let disk = SimulatedDisk::default();
                disk.inject(crash_at, Fault::Crash);
                let mut length = 0;
                for part in [b"first".as_slice(), b"second", b"third"] {
                    length = disk.append("log", length, part).unwrap_or(length);
                }
                let found = disk.after_crash(crash).read_if_there("log").unwrap().unwrap_or_default();
                let kept = length as usize;
                assert_eq!(
                    found.get(..kept),
                    b"firstsecondthird".get(..kept),
                    "operation {crash_at}, {crash:?}"
                );
            }
        }
    }

    /// The simulated disk is strict: without fsync a rename may leave nothing behind.
    #[test]
    fn unsynced_writes_can_be_lost() {
        let disk = SimulatedDisk::default();
        disk.write_atomic("f", b"old").unwrap();
        disk.write("f.tmp", 0, b"new").unwrap();
        disk.rename("f.tmp", "f").unwrap();
        disk.sync_folder("").unwrap();
        assert_eq!(disk.after_crash(Crash::Forget).read("f").unwrap(), b"");
        assert_eq!(disk.after_crash(Crash::Keep).read("f").unwrap(), b"new");
    }

    /// Seen to fail when the temporary file stays.
    #[test]
    fn a_full_disk_leaves_the_old_content_and_no_litter() {
        let disk = SimulatedDisk::default();
        disk.write_atomic("f", b"old").unwrap();
        disk.inject(disk.operations(), Fault::Full);
        let error = disk.write_atomic("f", b"new").unwrap_err();
        assert_eq!(
            error,
            StorageError::Full { operation: Operation::Write, path: "f.tmp".into(), needed: 3 }
        );
        assert_eq!(disk.list("").unwrap(), ["f"]);
        assert_eq!(disk.read("f").unwrap(), b"old");
    }
}
