//! The folder by which the processes of a user find one another. Whoever may write into it may pretend to be any of
//! them, so it is the user's alone, whoever came to its name first.

use std::fs::{DirBuilder, Metadata};
use std::io::ErrorKind;
use std::os::unix::fs::{DirBuilderExt, MetadataExt};
use std::path::Path;

use super::super::ChannelError;

/// Reading, writing and entering for the user, nothing for others.
const MODE: u32 = 0o700;

/// Number of the user whose rights this process has.
pub(super) fn user() -> u32 {
    rustix::process::geteuid().as_raw()
}

/// Path of the user's folder.
pub(super) fn root() -> String {
    format!("/tmp/surefoot-{}", user())
}

/// Makes the folder unless it is there, and refuses one that is not the user's alone.
pub(super) fn claim(root: &Path, user: u32) -> Result<(), ChannelError> {
    let refused = |found: String| ChannelError::Folder { folder: root.display().to_string(), user, found };
    match DirBuilder::new().mode(MODE).create(root) {
        Err(error) if error.kind() != ErrorKind::AlreadyExists => return Err(refused(error.to_string())),
        _ => {}
    }
    // Of the name itself, not of what it may point to.
    let about = std::fs::symlink_metadata(root).map_err(|error| refused(error.to_string()))?;
    strangers(&about, user).map_or(Ok(()), |found| Err(refused(found)))
}

/// Why others than the user may have their hands on it.
fn strangers(about: &Metadata, user: u32) -> Option<String> {
    let mode = about.mode() & 0o7777;
    if about.is_symlink() {
        Some("a symbolic link".to_owned())
    } else if !about.is_dir() {
        Some("no folder".to_owned())
    } else if about.uid() != user {
        Some(format!("a folder of user {}", about.uid()))
    } else {
        (mode != MODE).then(|| format!("mode {mode:o}"))
    }
}

#[cfg(test)]
mod tests {
    use std::fs::{Permissions, create_dir, set_permissions, write};
    use std::os::unix::fs::{PermissionsExt, symlink};

    use super::*;

    fn refusal(root: &Path, user: u32) -> String {
        let told = claim(root, user).unwrap_err().to_string();
        assert!(told.contains(&root.display().to_string()) && told.contains("mode 700"), "{told}");
        told
    }

    #[test]
    fn a_folder_is_made_for_the_user_alone_and_found_again() {
        let parent = tempfile::tempdir().unwrap();
        let root = parent.path().join("surefoot");
        for _ in 0..2 {
            claim(&root, user()).unwrap();
            assert_eq!(root.metadata().unwrap().mode() & 0o7777, 0o700);
        }
    }

    #[test]
    fn a_folder_that_others_may_have_their_hands_on_is_refused() {
        let parent = tempfile::tempdir().unwrap();
        let at = |name: &str| parent.path().join(name);
        for mode in [0o755, 0o770, 0o701, 0o1700] {
            let root = at(&format!("mode-{mode:o}"));
            create_dir(&root).unwrap();
            set_permissions(&root, Permissions::from_mode(mode)).unwrap();
            assert!(refusal(&root, user()).contains(&format!("found mode {mode:o}")));
        }
        claim(&at("own"), user()).unwrap();
        let other = refusal(&at("own"), user() + 1);
        assert!(other.contains(&format!("found a folder of user {}", user())), "{other}");
        symlink(at("own"), at("link")).unwrap();
        assert!(refusal(&at("link"), user()).contains("found a symbolic link"));
        symlink(at("nowhere"), at("dangling")).unwrap();
        assert!(refusal(&at("dangling"), user()).contains("found a symbolic link"));
        write(at("file"), "").unwrap();
        assert!(refusal(&at("file"), user()).contains("found no folder"));
        assert!(refusal(&at("absent/surefoot"), user()).contains("found No such file"));
    }
}
