//! Heliodon viewer.
