//! Names that a user's own logs give to columns.

use bicycle::Column;

/// Which column of a file stands for which of ours.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ColumnNames(Vec<Named>);

#[derive(Clone, Debug, PartialEq, Eq)]
struct Named {
    ours: String,
    in_file: String,
}

/// A mapping that cannot be.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ColumnNamesError {
    /// Not of the form `ours=theirs`.
    #[error("expected OURS=THEIRS, for instance vx=wheel_speed, found '{found}'")]
    Form {
        /// What was given.
        found: String,
    },
    /// The left side is no column of ours.
    #[error("expected one of {known} before '=', found '{found}'")]
    Unknown {
        /// What was given.
        found: String,
        /// All names.
        known: String,
    },
    /// One of ours would have two sources, or one source would be two of ours.
    #[error("expected each column once, found '{found}' twice")]
    Twice {
        /// What was given twice.
        found: String,
    },
}

impl ColumnNames {
    /// From words of the form `ours=theirs`; ours may be `t` and `run` as well.
    ///
    /// # Errors
    /// A word of another form, an unknown column of ours, a column named twice.
    pub fn parse<'a>(words: impl IntoIterator<Item = &'a str>) -> Result<Self, ColumnNamesError> {
        let mut names: Vec<Named> = Vec::new();
        for word in words {
            let sides = word.split_once('=').map(|(ours, theirs)| (ours.trim(), theirs.trim()));
            let (ours, in_file) = sides
                .filter(|(ours, theirs)| !ours.is_empty() && !theirs.is_empty())
                .ok_or_else(|| ColumnNamesError::Form { found: word.to_owned() })?;
            if !is_ours(ours) {
                let own = Column::ALL.into_iter().map(Column::name);
                let known = ["t", "run"].into_iter().chain(own).collect::<Vec<_>>().join(", ");
                return Err(ColumnNamesError::Unknown { found: ours.to_owned(), known });
            }
            let is_twice = |found: &str| ColumnNamesError::Twice { found: found.to_owned() };
            if names.iter().any(|named| named.ours == ours) {
                return Err(is_twice(ours));
            }
            if names.iter().any(|named| named.in_file == in_file) {
                return Err(is_twice(in_file));
            }
            names.push(Named { ours: ours.to_owned(), in_file: in_file.to_owned() });
        }
        Ok(Self(names))
    }

    /// A file's header in our names. Where a file has not the column that stands for one of ours, its own of that name
    /// counts; where it has, its own of that name is set aside.
    ///
    /// Errors: neither is there, as what was expected.
    pub fn renamed(&self, header: &[String]) -> Result<Vec<String>, String> {
        let has = |name: &String| header.contains(name);
        if let Some(Named { ours, in_file }) = self.0.iter().find(|own| !has(&own.in_file) && !has(&own.ours))
        {
            return Err(format!("a column '{in_file}', or '{ours}'"));
        }
        let renamed = |name: &String| {
            let stands_for = self.0.iter().find(|own| own.in_file == *name).map(|own| own.ours.clone());
            let is_replaced = self.0.iter().any(|own| own.ours == *name && has(&own.in_file));
            stands_for
                .unwrap_or_else(|| if is_replaced { format!("{name} of the file") } else { name.clone() })
        };
        Ok(header.iter().map(renamed).collect())
    }
}

fn is_ours(name: &str) -> bool {
    ["t", "run"].contains(&name) || Column::from_name(name).is_some()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn renamed(words: &[&str], header: &str) -> Result<Vec<String>, String> {
        let header: Vec<String> = header.split(',').map(str::to_owned).collect();
        ColumnNames::parse(words.iter().copied()).unwrap().renamed(&header)
    }

    #[test]
    fn a_column_of_the_file_stands_for_ours_and_its_own_of_that_name_is_set_aside() {
        let names = renamed(&["t=stamp", "vx=wheel_speed"], "stamp,vx,wheel_speed,wz").unwrap();
        assert_eq!(names, ["t", "vx of the file", "vx", "wz"]);
        assert_eq!(renamed(&["vx=speed"], "t,vx").unwrap(), ["t", "vx"]);
        assert_eq!(renamed(&["vx=wz", "wz=vx"], "t,vx,wz").unwrap(), ["t", "wz", "vx"]);
        assert_eq!(renamed(&["vx=speed"], "t,wz"), Err("a column 'speed', or 'vx'".to_owned()));
    }

    #[test]
    fn mappings_that_cannot_be_are_refused() {
        let told = |words: &[&str]| ColumnNames::parse(words.iter().copied()).unwrap_err().to_string();
        assert!(told(&["vx"]).contains("expected OURS=THEIRS") && told(&["=a"]).contains("found '=a'"));
        assert!(
            told(&["velocity=vx"]).starts_with("expected one of t, run, x, y,"),
            "{}",
            told(&["velocity=vx"])
        );
        assert!(told(&["vx=a", "vx=b"]).contains("found 'vx' twice"));
        assert!(told(&["vx=a", "wheel_speed=a"]).contains("found 'a' twice"));
    }
}
