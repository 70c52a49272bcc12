//! A bake that goes on where it was killed.

use std::ops::ControlFlow;
use std::path::Path;

use radiosity::bake::BakeProgress;
use radiosity::work::{Journal, JournalPart, with_journal};
use radiosity::{Backend, BakeResult, BakeTarget, Error, ErrorKind};

use super::processes::{bits, cornell_box, go};
use crate::common::processes::in_processes;

fn parts(scene: u64) -> Vec<JournalPart> {
    vec![
        JournalPart { name: "scene".into(), hash: scene },
        JournalPart { name: "settings".into(), hash: 1 },
    ]
}

fn open(path: &Path) -> Result<Journal, Error> {
    Journal::open(path, &parts(7))
}

fn bake(mut progress: impl FnMut(&BakeProgress) -> ControlFlow<()>) -> BakeResult {
    BakeTarget::Error(0.1).bake(cornell_box(), &Backend::Cpu, &mut progress).unwrap()
}

/// The bake with the journal at `path`.
fn resumed(path: &Path) -> BakeResult {
    let mut journal = Some(open(path).unwrap());
    let baked = with_journal(&mut journal, || bake(go));
    journal.unwrap().finish().unwrap();
    baked
}

#[test]
fn bake_goes_on_from_any_byte_of_its_journal_to_the_same_bits() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bake.state");
    let undisturbed = bits(&bake(go));
    assert!(bits(&resumed(&path)) == undisturbed, "kept");
    let whole = std::fs::read(&path).unwrap();
    assert!(bits(&resumed(&path)) == undisturbed, "read");
    assert!(std::fs::read(&path).unwrap() == whole, "nothing was computed anew");
    // Torn in its head, in its first record, in others, in its last.
    for end in [0, 5, 30, 1000, whole.len() / 2, whole.len() - 1] {
        std::fs::write(&path, &whole[..end]).unwrap();
        assert!(bits(&resumed(&path)) == undisturbed, "{end} of {} bytes", whole.len());
        // Batches end elsewhere, so that the file may be another.
        assert!(std::fs::metadata(&path).unwrap().len() > end as u64);
    }
}

#[test]
fn journal_is_of_one_run_at_a_time() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bake.state");
    let journal = open(&path).unwrap();
    let error = open(&path).unwrap_err();
    assert_eq!(error.kind(), ErrorKind::File);
    let said = error.to_string();
    assert!(said.contains("bake.state") && said.contains("another run"), "{said}");
    journal.finish().unwrap();
    open(&path).unwrap();
}

#[test]
fn journal_of_one_process_serves_several() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bake.state");
    let undisturbed = bits(&resumed(&path));
    let whole = std::fs::read(&path).unwrap();
    std::fs::write(&path, &whole[..whole.len() / 2]).unwrap();
    let of_all = in_processes(2, |rank| {
        let mut journal = (rank == 0).then(|| open(&path).unwrap());
        bits(&with_journal(&mut journal, || bake(go)))
    });
    assert!(of_all.iter().all(|baked| *baked == undisturbed));
    // And that of several one.
    std::fs::remove_file(&path).unwrap();
    in_processes(3, |rank| {
        let mut journal = (rank == 0).then(|| open(&path).unwrap());
        with_journal(&mut journal, || {
            bake(|stage| match stage {
                BakeProgress::Estimating { .. } => ControlFlow::Break(()),
                _ => ControlFlow::Continue(()),
            })
        });
    });
    assert!(bits(&resumed(&path)) == undisturbed);
}

#[test]
fn journals_of_other_work_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bake.state");
    drop(open(&path).unwrap());
    let error = Journal::open(&path, &parts(8)).unwrap_err();
    assert_eq!(error.kind(), ErrorKind::File);
    assert!(error.to_string().contains("other 'scene'"), "{error}");
    let more = [parts(7), vec![JournalPart { name: "device".into(), hash: 0 }]].concat();
    assert!(Journal::open(&path, &more).unwrap_err().to_string().contains("'device'"));
    for other in [&b"v 0 0 0\nv 1 0 0\n"[..], b"radilog\x09........"] {
        std::fs::write(&path, other).unwrap();
        let error = open(&path).unwrap_err().to_string();
        assert!(error.contains("not a state"), "{error}");
        assert!(std::fs::read(&path).unwrap() == other, "it is left as it is");
    }
    let error = open(folder.path()).unwrap_err();
    assert_eq!(error.kind(), ErrorKind::File, "{error}");
}
