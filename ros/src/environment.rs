//! The variables by which ROS 2 says who may hear whom.

/// Why no node can be made as the environment says. Every message is one line.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum EnvironmentError {
    /// No such domain.
    #[error("ROS_DOMAIN_ID: expected a number from 0 to 232, found {found:?}")]
    Domain {
        /// What it says.
        found: String,
    },
    /// No such range.
    #[error("ROS_AUTOMATIC_DISCOVERY_RANGE: expected SUBNET, LOCALHOST or SYSTEM_DEFAULT, found {found:?}")]
    Range {
        /// What it says.
        found: String,
    },
    /// Peers of names or numbers are not looked for.
    #[error(
        "ROS_STATIC_PEERS: expected it unset, found {found:?}; nodes find one another by multicast or on this machine"
    )]
    Peers {
        /// What it says.
        found: String,
    },
}

/// Who may hear the node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Discovery {
    /// The domain.
    pub domain_id: u16,
    /// How far.
    pub range: Range,
}

/// How far nodes look for one another.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Range {
    /// On this machine alone.
    Localhost,
    /// In its networks, too.
    Subnet,
}

/// What the variables say, each read by `variable`; where they say nothing, the domain is `domain_id`.
///
/// # Errors
/// See [`EnvironmentError`].
pub fn discovery(
    variable: impl Fn(&str) -> Option<String>,
    domain_id: u16,
) -> Result<Discovery, EnvironmentError> {
    let said = |name: &str| variable(name).filter(|value| !value.trim().is_empty());
    let domain = said("ROS_DOMAIN_ID").map(|found| {
        let number = found.trim().parse().ok().filter(|number| *number <= 232);
        number.ok_or(EnvironmentError::Domain { found })
    });
    if let Some(found) = said("ROS_STATIC_PEERS") {
        return Err(EnvironmentError::Peers { found });
    }
    // The older variable goes before the newer one, as it does in ROS.
    let range = match (said("ROS_LOCALHOST_ONLY").as_deref(), said("ROS_AUTOMATIC_DISCOVERY_RANGE")) {
        (Some("1"), _) => Range::Localhost,
        (_, None) => Range::Subnet,
        (_, Some(found)) => match found.as_str() {
            "LOCALHOST" => Range::Localhost,
            "SUBNET" | "SYSTEM_DEFAULT" => Range::Subnet,
            _ => return Err(EnvironmentError::Range { found }),
        },
    };
    Ok(Discovery { domain_id: domain.transpose()?.unwrap_or(domain_id), range })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(variables: &[(&str, &str)]) -> Result<Discovery, EnvironmentError> {
        let variable = |name: &str| {
            variables.iter().find(|(known, _)| *known == name).map(|(_, value)| (*value).to_owned())
        };
        discovery(variable, 7)
    }

    #[test]
    fn variables_say_domain_and_range() {
        let found = |variables: &[(&str, &str)]| {
            of(variables).map(|Discovery { domain_id, range }| (domain_id, range))
        };
        assert_eq!(found(&[]), Ok((7, Range::Subnet)));
        assert_eq!(found(&[("ROS_DOMAIN_ID", " 42")]), Ok((42, Range::Subnet)));
        assert_eq!(found(&[("ROS_DOMAIN_ID", "")]), Ok((7, Range::Subnet)), "as in ROS");
        assert_eq!(found(&[("ROS_LOCALHOST_ONLY", "0")]), Ok((7, Range::Subnet)));
        let local = ("ROS_LOCALHOST_ONLY", "1");
        assert_eq!(found(&[local, ("ROS_AUTOMATIC_DISCOVERY_RANGE", "SUBNET")]), Ok((7, Range::Localhost)));
        assert_eq!(found(&[("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")]), Ok((7, Range::Localhost)));
    }

    #[test]
    fn what_cannot_be_done_is_refused() {
        for wrong in ["233", "-1", "seven"] {
            let told = of(&[("ROS_DOMAIN_ID", wrong)]).unwrap_err().to_string();
            assert_eq!(told, format!("ROS_DOMAIN_ID: expected a number from 0 to 232, found {wrong:?}"));
        }
        let off = of(&[("ROS_AUTOMATIC_DISCOVERY_RANGE", "OFF")]).unwrap_err().to_string();
        assert!(off.ends_with("found \"OFF\""), "{off}");
        assert!(of(&[("ROS_STATIC_PEERS", "10.0.0.2")]).is_err());
    }
}
