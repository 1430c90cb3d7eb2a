//! Groups of an HDF5-based file, walked with a bound before the reader walks them: it follows every link, and a group that holds itself
//! would end the program by its stack.

use std::path::Path;

use hdf5_reader::group::Group;
use hdf5_reader::{Hdf5File, OpenOptions};

/// Deepest group, and most groups and variables with every link followed: logs nest two deep and hold a thousand.
const DEEPEST_GROUP: usize = 16;
const MOST_OBJECTS: usize = 20_000;

/// Refuses a file whose groups have no end. Other damage is for the reader to name.
pub(super) fn have_an_end(path: &Path) -> Result<(), String> {
    let root = Hdf5File::open_with_options(path, OpenOptions::default()).and_then(|file| file.root_group());
    root.map_or(Ok(()), |root| walk(&root, &mut vec![root.address()], &mut 0))
}

fn walk(group: &Group, above: &mut Vec<u64>, objects: &mut usize) -> Result<(), String> {
    // What cannot be listed here cannot be listed by the reader.
    let Ok((groups, variables)) = group.members() else { return Ok(()) };
    *objects += groups.len() + variables.len();
    if *objects > MOST_OBJECTS {
        return Err(format!("its groups hold more than {MOST_OBJECTS} groups and variables, every link followed"));
    }
    for child in &groups {
        if above.contains(&child.address()) {
            return Err(format!("group {} holds itself", child.name()));
        }
        if above.len() > DEEPEST_GROUP {
            return Err(format!("its groups are nested more than {DEEPEST_GROUP} deep"));
        }
        above.push(child.address());
        walk(child, above, objects)?;
        above.pop();
    }
    Ok(())
}
