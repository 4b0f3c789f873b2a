//! A flipped bit in a store of weeks that nobody notices is a wrong result that nobody doubts. Bytes are flipped and
//! files cut over all files of a store; each damage must be named, repaired or without effect, to the last bit of what
//! the store holds in the end. (`damage-campaign` does 500 of them.)

use tests::damage::{Fate, Original, Table};
use tests::random::Random;

#[test]
fn every_damage_is_named_repaired_or_without_effect() {
    let original = Original::new();
    let rounds = original.files().len();
    assert!(rounds >= 20, "{:?}", original.files());
    let (mut random, mut table) = (Random::new(3), Table::default());
    for number in 0..rounds {
        table.add(original.damage(number, &mut random));
    }
    println!("{:#?}", table.counts);
    assert!(table.failures.is_empty(), "{:#?}", table.failures);
    let fates = [Fate::Refused, Fate::Repaired, Fate::WithoutEffect];
    for fate in fates {
        assert!(table.of(fate) > 0, "nothing ended as {fate:?}");
    }
}
