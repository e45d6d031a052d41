//! The disk of this machine.

use std::fs::{self, File, OpenOptions};
use std::io::{ErrorKind, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use super::{Operation, Storage, StorageError};

/// Files below a folder of this machine. The folder is made when something is first written.
#[derive(Clone, Debug)]
pub struct RealDisk {
    root: PathBuf,
}

impl RealDisk {
    pub fn new(root: impl Into<PathBuf>) -> RealDisk {
        RealDisk { root: root.into() }
    }

    pub fn root(&self) -> &Path {
        &self.root
    }

    fn at(&self, path: &str) -> PathBuf {
        if path.is_empty() { self.root.clone() } else { self.root.join(path) }
    }

    /// Says which file could not be used, for what, and why.
    fn error(&self, operation: Operation, path: &str, needed: usize, why: std::io::Error) -> StorageError {
        let path = self.at(path).display().to_string();
        match why.kind() {
            ErrorKind::NotFound => StorageError::Missing { operation, path },
            ErrorKind::StorageFull | ErrorKind::QuotaExceeded => {
                StorageError::Full { operation, path, needed: needed as u64 }
            }
            ErrorKind::PermissionDenied | ErrorKind::ReadOnlyFilesystem => {
                StorageError::Denied { operation, path }
            }
            _ => StorageError::Failed { operation, path, cause: why.to_string() },
        }
    }
}

impl Storage for RealDisk {
    fn read(&self, path: &str) -> Result<Vec<u8>, StorageError> {
        fs::read(self.at(path)).map_err(|why| self.error(Operation::Read, path, 0, why))
    }

    fn list(&self, folder: &str) -> Result<Vec<String>, StorageError> {
        let mut files = Vec::new();
        let mut below = vec![String::new()];
        while let Some(prefix) = below.pop() {
            let here = if prefix.is_empty() { folder.to_string() } else { format!("{folder}/{prefix}") };
            let entries = match fs::read_dir(self.at(here.trim_start_matches('/'))) {
                Err(why) if why.kind() == ErrorKind::NotFound => continue,
                entries => entries.map_err(|why| self.error(Operation::List, &here, 0, why))?,
            };
            for entry in entries {
                let entry = entry.map_err(|why| self.error(Operation::List, &here, 0, why))?;
                let is_folder =
                    entry.file_type().map_err(|why| self.error(Operation::List, &here, 0, why))?.is_dir();
                let Ok(name) = entry.file_name().into_string() else { continue };
                let path = if prefix.is_empty() { name } else { format!("{prefix}/{name}") };
                if is_folder { &mut below } else { &mut files }.push(path);
            }
        }
        files.sort();
        Ok(files)
    }

    fn make_folder(&self, folder: &str) -> Result<bool, StorageError> {
        let at = self.at(folder);
        let made = match folder {
            "" => create_durably(&at).map(|()| true),
            _ if at.is_dir() => Ok(false),
            _ => fs::create_dir(at).map(|()| true),
        };
        match made {
            // Another thread was quicker.
            Err(why) if why.kind() == ErrorKind::AlreadyExists && self.at(folder).is_dir() => Ok(false),
            made => made.map_err(|why| self.error(Operation::CreateFolder, folder, 0, why)),
        }
    }

    fn write(&self, path: &str, at: u64, bytes: &[u8]) -> Result<(), StorageError> {
        let write = || {
            let mut file =
                OpenOptions::new().write(true).create(at == 0).truncate(false).open(self.at(path))?;
            if file.metadata()?.len() < at {
                return Err(std::io::Error::other(format!("it is shorter than {at} bytes")));
            }
            file.set_len(at)?;
            file.seek(SeekFrom::Start(at))?;
            file.write_all(bytes)
        };
        write().map_err(|why| self.error(Operation::Write, path, bytes.len(), why))
    }

    fn sync(&self, path: &str) -> Result<(), StorageError> {
        File::open(self.at(path))
            .and_then(|file| file.sync_all())
            .map_err(|why| self.error(Operation::Sync, path, 0, why))
    }

    fn sync_folder(&self, folder: &str) -> Result<(), StorageError> {
        self.sync(folder)
    }

    fn rename(&self, from: &str, to: &str) -> Result<(), StorageError> {
        fs::rename(self.at(from), self.at(to)).map_err(|why| self.error(Operation::Rename, from, 0, why))
    }

    fn create_new(&self, path: &str, bytes: &[u8]) -> Result<bool, StorageError> {
        let complete = format!("{path}.{}", std::process::id());
        self.write(&complete, 0, bytes)?;
        self.sync(&complete)?;
        let linked = match fs::hard_link(self.at(&complete), self.at(path)) {
            // Some file systems have no hard links; there the file is made first and filled after.
            Err(why) if matches!(why.kind(), ErrorKind::Unsupported | ErrorKind::PermissionDenied) => {
                OpenOptions::new().write(true).create_new(true).open(self.at(path)).and_then(|mut file| {
                    file.write_all(bytes)?;
                    file.sync_all()
                })
            }
            linked => linked,
        };
        let _ = fs::remove_file(self.at(&complete));
        match linked {
            Ok(()) => Ok(true),
            Err(why) if why.kind() == ErrorKind::AlreadyExists => Ok(false),
            Err(why) => Err(self.error(Operation::Write, path, bytes.len(), why)),
        }
    }

    fn remove(&self, path: &str) -> Result<(), StorageError> {
        fs::remove_file(self.at(path)).map_err(|why| self.error(Operation::Remove, path, 0, why))
    }
}

/// Makes a folder and those above it, and makes each new name durable.
fn create_durably(folder: &Path) -> std::io::Result<()> {
    if folder.is_dir() {
        return Ok(());
    }
    let above = folder.parent().filter(|above| !above.as_os_str().is_empty()).unwrap_or(Path::new("."));
    create_durably(above)?;
    match fs::create_dir(folder) {
        Err(why) if why.kind() != ErrorKind::AlreadyExists => return Err(why),
        _ => {}
    }
    File::open(above)?.sync_all()
}
