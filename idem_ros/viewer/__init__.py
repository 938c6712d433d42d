"""One registration to look at: both clouds in 3D, step by step, and what the verdict stands on."""
