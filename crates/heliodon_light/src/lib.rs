//! Heliodon's light solver: sun masks, sky transfer, sun bounce at vertices, and the reference path tracer.
