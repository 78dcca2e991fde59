//! What can be wrong with lights as they are described.

use thiserror::Error;

/// Why a light cannot be made as it is described.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum LightSpecError {
    /// A number outside its range.
    #[error("light {light}: {field} is {value}, but must be {allowed}")]
    Field {
        /// The light's name, in quotes, or its kind where it has none.
        light: String,
        /// The field's name as in a site file.
        field: &'static str,
        /// Its value.
        value: String,
        /// What is allowed.
        allowed: &'static str,
    },
    /// An amount in a unit that this kind of light has not.
    #[error("light {light}: {unit} says nothing for a {kind} light; give its amount as {allowed}")]
    Unit {
        /// The light's name, in quotes, or its kind where it has none.
        light: String,
        /// The kind of light.
        kind: &'static str,
        /// The unit that was given.
        unit: &'static str,
        /// Those that it may have.
        allowed: &'static str,
    },
    /// A file that a light names cannot be used.
    #[error("light {light}: file {file:?}: {message}")]
    File {
        /// The light's name, in quotes, or its kind where it has none.
        light: String,
        /// The file as it is named.
        file: String,
        /// What is wrong with it, and what to do.
        message: String,
    },
}
