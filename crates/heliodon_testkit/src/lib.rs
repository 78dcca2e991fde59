//! Analytic scenes, the hostile corpus and image difference for Heliodon's tests.
