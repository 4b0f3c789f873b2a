//! Looking after the store: damage is found, named, and ends with the exit code of the store.

mod common;

use common::Bench;

#[test]
fn a_sound_store_is_called_sound_and_counted() {
    let bench = Bench::new();
    bench.submit("block.yaml");
    let info = bench.run(&["store", "info", "--json"]).good().json();
    assert_eq!(
        (info["runs"].as_u64(), info["steps"].as_u64()),
        (Some(1), Some(4))
    );
    let check = bench
        .run(&["store", "check", "--deep", "--json"])
        .good()
        .json();
    assert_eq!(check["sound"].as_bool(), Some(true), "{check}");
    let rebuilt = bench.run(&["store", "rebuild", "--json"]).good().json();
    assert_eq!(
        (rebuilt["steps"].as_u64(), rebuilt["lost"].as_u64()),
        (Some(4), Some(0))
    );
}

#[test]
fn a_flipped_byte_does_not_pass_a_deep_check() {
    let bench = Bench::new();
    bench.submit("block.yaml");
    let packs = bench.store().join("packs/block");
    let pack = std::fs::read_dir(&packs)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| {
            path.extension()
                .is_some_and(|extension| extension == "pack")
        })
        .max()
        .unwrap();
    let mut bytes = std::fs::read(&pack).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 0x10;
    std::fs::write(&pack, bytes).unwrap();
    let check = bench.run(&["store", "check", "--deep", "--json"]);
    assert_eq!(check.code, 3, "{}", check.out);
    let report = check.json();
    assert_eq!(
        (report["sound"].as_bool(), report["error"]["kind"].as_str()),
        (Some(false), Some("store"))
    );
    let name = pack.file_name().unwrap().to_str().unwrap();
    assert!(report["findings"].to_string().contains(name), "{report}");
    let text = bench.run(&["store", "check", "--deep"]);
    assert!(text.code == 3 && text.out.contains(name) && text.err.contains("damaged"));
}

/// The database alone knew of it, so the check of the files found nothing and called the store sound.
#[test]
fn a_run_whose_folder_is_gone_is_damage() {
    let bench = Bench::new();
    bench.submit("block.yaml");
    std::fs::remove_dir_all(bench.store().join("packs/block")).unwrap();
    let check = bench.run(&["store", "check", "--json"]);
    assert_eq!(check.code, 3, "{}", check.out);
    assert_eq!(check.json()["sound"].as_bool(), Some(false));
}

/// Every message about a damaged pack advises to set the run back; without a verb for it the run was lost.
#[test]
fn a_run_with_a_damaged_last_step_is_set_back_and_computed_again() {
    let bench = Bench::new();
    bench.submit("block.yaml");
    let digest =
        |bench: &Bench| bench.run(&["show", "block", "--json"]).good().json()["digest"].clone();
    let whole = digest(&bench);
    let pack = bench.store().join("packs/block/00000003.pack");
    std::fs::write(&pack, b"nothing of use").unwrap();
    assert_eq!(bench.run(&["store", "check"]).code, 3);
    bench.run(&["store", "set-back", "block@2"]).good();
    bench.run(&["store", "check", "--deep"]).good();
    bench.run(&["resume", "block"]).good();
    assert_eq!(digest(&bench), whole);
    for wrong in ["block", "block@last", "block@99", "nope@1"] {
        assert_eq!(bench.run(&["store", "set-back", wrong]).code, 2, "{wrong}");
    }
}
