//! One run on its way in: its files aside, checked one by one.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::path::{Path, PathBuf};

use super::contents::{RunContents, StepContents};
use super::naming::Given;
use super::reader::ArchiveReader;
use crate::error::{ImportError, IoFailure, ReadError};
use crate::files;
use crate::frame;
use crate::id::{Digest, RunName, StepAddress, StepIndex};
use crate::label::{self, LabelFile};
use crate::layout::{self, Layout};
use crate::pack::{PackWriter, Predecessor, StepHeader};
use crate::prune::Stub;
use crate::record::{self, to_rmp};
use crate::run::{self, RunFile, StateFile};
use crate::step::StepReader;

/// Digests of the steps that came in, by the archive's addresses.
pub(super) type Digests = BTreeMap<StepAddress, Digest>;

/// A run on its way in.
pub(super) struct Arrival {
    /// What the archive has of it.
    pub(super) contents: RunContents,
    /// Its name here.
    pub(super) name: RunName,
    /// The step it takes up, by the archive's names.
    parent: Option<StepAddress>,
    /// Its folder aside.
    dir: PathBuf,
    has_state: bool,
    /// Steps that came in.
    pub(super) steps: usize,
    /// Bytes of its packs.
    pub(super) bytes: u64,
}

impl Arrival {
    /// Makes the folder with the run's record, under its name here.
    pub(super) fn begin(
        layout: &Layout,
        contents: RunContents,
        file: RunFile,
        name: RunName,
        given: &Given,
        archive: &ArchiveReader,
    ) -> Result<Self, ImportError> {
        let dir = layout.arriving().join(name.as_str());
        files::create_folder(&dir)?;
        let parent = match &file.parent {
            None => None,
            Some(parent) => match given.address(parent) {
                None => return Err(archive.damaged(format!("it lacks {parent}"))),
                here => here,
            },
        };
        let arrival = Self {
            contents,
            name: name.clone(),
            parent: file.parent.clone(),
            dir,
            has_state: false,
            steps: 0,
            bytes: 0,
        };
        let file = RunFile {
            name,
            parent,
            ..file
        };
        run::write_records(&arrival.dir, &file)?;
        Ok(arrival)
    }

    pub(super) fn state(&mut self, state: &StateFile) -> Result<(), ImportError> {
        self.has_state = true;
        Ok(record::write(&self.dir.join(layout::STATE), state)?)
    }

    pub(super) fn label(&self, label: RunName) -> Result<(), ImportError> {
        let file = LabelFile {
            run: self.name.clone(),
            label,
        };
        Ok(record::write(&self.dir.join(label::FILE), &file)?)
    }

    pub(super) fn events(&self, archive: &mut ArchiveReader) -> Result<(), ImportError> {
        self.file(&self.dir.join(layout::EVENTS), archive)
    }

    /// A file as the archive has it.
    fn file(&self, path: &Path, archive: &mut ArchiveReader) -> Result<(), ImportError> {
        let mut file = File::create(path).map_err(IoFailure::of("create", path))?;
        archive.copy_content(&mut file, path)?;
        file.sync_data().map_err(IoFailure::of("write", path))?;
        Ok(())
    }

    /// A sealed step: every byte checked, and whether it continues from what came before. Where runs got other names its
    /// frames are sealed again under these; its digest stays.
    pub(super) fn pack(
        &mut self,
        step: StepIndex,
        digests: &mut Digests,
        given: &Given,
        archive: &mut ArchiveReader,
    ) -> Result<(), ImportError> {
        let expected = self.expect(step, archive)?;
        let path = self.dir.join(layout::pack_name(step));
        self.file(&path, archive)?;
        let address = self.address(step);
        let flaw = |what: String| archive.damaged(format!("{address}: {what}"));
        let read = StepReader::open(&path, &address).and_then(|reader| {
            reader.verify()?;
            Ok(reader)
        });
        let reader = read.map_err(|error| match error {
            // The file aside goes; what is damaged is the archive.
            ReadError::Damaged(damage) => flaw(damage.what),
            other => other.into(),
        })?;
        if expected.pruned || reader.digest() != expected.digest {
            return Err(flaw("it is not the step of the table".to_owned()));
        }
        if let Some((before, digest)) = reader.predecessor()
            && digests.get(before) != Some(&digest)
        {
            return Err(flaw(format!(
                "it does not continue from the {before} that is here"
            )));
        }
        self.bytes += reader.bytes();
        let before = reader.predecessor().map(|(before, _)| before.clone());
        let here = StepAddress {
            run: self.name.clone(),
            step,
        };
        let renamed = |address: &StepAddress| given.address(address).as_ref() != Some(address);
        if here != address || before.as_ref().is_some_and(renamed) {
            let header = StepHeader {
                run: here.run,
                step,
                predecessor: match &reader.header.predecessor {
                    None => None,
                    Some(before) => Some(Predecessor {
                        address: given
                            .address(&before.address)
                            .ok_or_else(|| flaw(format!("{} is not here", before.address)))?,
                        digest: before.digest,
                    }),
                },
            };
            seal_again(&path, &reader, &header)?;
        }
        digests.insert(address, expected.digest);
        Ok(())
    }

    /// A pruned step.
    pub(super) fn stub(
        &mut self,
        step: StepIndex,
        digests: &mut Digests,
        archive: &mut ArchiveReader,
    ) -> Result<(), ImportError> {
        let expected = self.expect(step, archive)?;
        let bytes = archive.content()?;
        let stub: Stub = record::unseal(&bytes).map_err(|what| archive.damaged(what))?;
        let address = self.address(step);
        let told = (&stub.run, stub.step, stub.digest);
        if !expected.pruned || told != (&address.run, step, expected.digest) {
            return Err(archive.damaged(format!("{address}: it is not the step of the table")));
        }
        let stub = Stub {
            run: self.name.clone(),
            ..stub
        };
        record::write(&self.dir.join(layout::stub_name(step)), &stub)?;
        digests.insert(address, expected.digest);
        Ok(())
    }

    /// What the table says of the step that comes next.
    fn expect(
        &mut self,
        step: StepIndex,
        archive: &ArchiveReader,
    ) -> Result<StepContents, ImportError> {
        let expected = self.contents.steps.get(self.steps);
        match expected.filter(|expected| expected.step == step) {
            Some(expected) => {
                self.steps += 1;
                Ok(expected.clone())
            }
            None => {
                let address = self.address(step);
                Err(archive.damaged(format!("{address} is not the step that comes next")))
            }
        }
    }

    fn address(&self, step: StepIndex) -> StepAddress {
        StepAddress {
            run: self.contents.run.clone(),
            step,
        }
    }

    /// Checks that all is here, and makes it last.
    pub(super) fn end(
        &self,
        digests: &Digests,
        archive: &ArchiveReader,
    ) -> Result<(), ImportError> {
        let run = &self.contents.run;
        if !self.has_state || self.steps < self.contents.steps.len() {
            return Err(archive.damaged(format!("it lacks a part of `{run}`")));
        }
        if let Some(parent) = self
            .parent
            .as_ref()
            .filter(|parent| !digests.contains_key(parent))
        {
            return Err(archive.damaged(format!("it lacks {parent}")));
        }
        Ok(files::sync_folder(&self.dir)?)
    }
}

/// Writes the frames of an open pack, as they are stored, into a new one with another header, in its place.
fn seal_again(path: &Path, reader: &StepReader, header: &StepHeader) -> Result<(), ImportError> {
    let mut pack = PackWriter::create(path, to_rmp(header))?;
    for id in reader.pack.ids().filter(|id| *id != frame::HEADER) {
        let (frame, bytes) = reader.pack.stored(id)?;
        pack.carry_over(frame, &bytes)?;
    }
    // The digest is of the content, which is the same to the byte.
    pack.seal()?;
    Ok(())
}

/// Removes what an import left aside that did not come to its end.
pub(super) fn sweep(layout: &Layout) -> Result<(), IoFailure> {
    let dir = layout.arriving();
    match dir.exists() {
        true => fs::remove_dir_all(&dir).map_err(IoFailure::of("remove", &dir)),
        false => Ok(()),
    }
}
