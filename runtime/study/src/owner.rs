//! One run at a time in a folder: a file tells who owns it.

use serde::{Deserialize, Serialize};

use crate::error::StudyError;
use crate::storage::Storage;

const FILE: &str = "owner.json";

/// The process that runs a study.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Owner {
    pub pid: u32,
    pub host: String,
    /// When the run began, for people.
    pub since: String,
    /// When the process began, in ticks after boot; tells it from a later one with the same number.
    pub began: Option<u64>,
}

impl Owner {
    /// This process, now.
    pub fn this_process() -> Owner {
        let pid = std::process::id();
        let host = std::fs::read_to_string("/proc/sys/kernel/hostname").unwrap_or_default();
        let host = if host.trim().is_empty() { "this machine".to_string() } else { host.trim().to_string() };
        Owner {
            pid,
            host,
            since: jiff::Timestamp::now().strftime("%F %T UTC").to_string(),
            began: began(pid),
        }
    }

    /// Whether the process is gone. Only known of processes of the same machine.
    fn is_dead(&self, seen_from: &Owner) -> bool {
        self.host == seen_from.host && self.began.is_some() && began(self.pid) != self.began
    }
}

/// When a process of this machine began: field 22 of `/proc/<pid>/stat`, counted after the name in brackets.
fn began(pid: u32) -> Option<u64> {
    let line = std::fs::read_to_string(format!("/proc/{pid}/stat")).ok()?;
    let (_, after_name) = line.rsplit_once(')')?;
    after_name.split_whitespace().nth(19)?.parse().ok()
}

/// Holds the folder until it is dropped.
pub(crate) struct Lock<'a>(&'a dyn Storage);

impl Drop for Lock<'_> {
    fn drop(&mut self) {
        // If this fails, the next run finds a dead owner and takes over.
        let _ = self.0.remove(FILE);
    }
}

/// Takes the folder, from a dead owner if need be.
pub(crate) fn acquire<'a>(storage: &'a dyn Storage, me: &Owner) -> Result<Lock<'a>, StudyError> {
    let unwritable = |why: serde_json::Error| StudyError::Unwritable { what: FILE, cause: why.to_string() };
    let mine = serde_json::to_vec(me).map_err(unwritable)?;
    loop {
        if storage.create_new(FILE, &mine)? {
            tidy(storage);
            return Ok(Lock(storage));
        }
        let Some(found) = storage.read_if_there(FILE)? else { continue };
        let in_use =
            |by: Owner| Err(StudyError::InUse { pid: by.pid, host: by.host, since: by.since, file: FILE });
        match serde_json::from_slice::<Owner>(&found) {
            Ok(other) if !other.is_dead(me) => return in_use(other),
            _ => {}
        }
        // Another run may do the same: what was moved away must be what was found dead.
        let aside = format!("{FILE}.{}", me.pid);
        match storage.rename(FILE, &aside) {
            Err(crate::storage::StorageError::Missing { .. }) => continue,
            moved => moved?,
        }
        let moved = storage.read(&aside)?;
        if moved != found {
            storage.rename(&aside, FILE)?;
            continue;
        }
        storage.remove(&aside)?;
    }
}

/// Removes what processes have left that were killed while they took the folder: `owner.json.<pid>`.
fn tidy(storage: &dyn Storage) {
    let prefix = format!("{FILE}.");
    for name in storage.list("").unwrap_or_default() {
        let left_by = name.strip_prefix(&prefix).and_then(|pid| pid.parse().ok());
        if left_by.is_some_and(|pid: u32| began(pid).is_none()) {
            let _ = storage.remove(&name);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::storage::SimulatedDisk;

    /// Seen to fail when whoever is found counts as dead.
    #[test]
    fn a_folder_has_one_owner() {
        let disk = SimulatedDisk::default();
        let me = Owner::this_process();
        let lock = acquire(&disk, &me).unwrap();
        let Err(StudyError::InUse { pid, host, .. }) = acquire(&disk, &me) else { panic!("two owners") };
        assert_eq!((pid, host), (me.pid, me.host.clone()));
        drop(lock);
        assert!(acquire(&disk, &me).is_ok());
    }

    /// Seen to fail when nobody counts as dead, when the machine is not compared, or when the time is not at which the process began.
    #[test]
    fn the_dead_are_succeeded_but_not_those_of_other_machines() {
        let me = Owner::this_process();
        let dead = Owner { pid: u32::MAX, began: Some(1), ..me.clone() };
        let reused = Owner { began: me.began.map(|ticks| ticks + 1), ..me.clone() };
        let elsewhere = Owner { host: "elsewhere".into(), ..dead.clone() };
        for (other, taken) in [(dead, true), (reused, true), (elsewhere, false)] {
            let disk = SimulatedDisk::default();
            disk.create_new(FILE, &serde_json::to_vec(&other).unwrap()).unwrap();
            assert_eq!(acquire(&disk, &me).is_ok(), taken, "{other:?}");
        }
    }

    /// Seen to fail when such a file counts as an owner.
    #[test]
    fn a_damaged_owner_file_does_not_lock_forever() {
        let disk = SimulatedDisk::default();
        disk.create_new(FILE, b"{\"pid\": 1").unwrap();
        assert!(acquire(&disk, &Owner::this_process()).is_ok());
        assert_eq!(disk.list("").unwrap(), Vec::<String>::new());
    }

    /// Seen to fail when nothing is tidied.
    #[test]
    fn what_the_dead_left_while_they_took_the_folder_is_removed() {
        let disk = SimulatedDisk::default();
        let (me, dead) = (Owner::this_process(), u32::MAX);
        let theirs = format!("{FILE}.{}", me.pid);
        for left in [format!("{FILE}.{dead}"), theirs.clone()] {
            disk.create_new(&left, b"{}").unwrap();
        }
        drop(acquire(&disk, &me).unwrap());
        assert_eq!(disk.list("").unwrap(), [theirs]);
    }
}
