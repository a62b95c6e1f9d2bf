"""From the scene to keyframes: jobs, batches, the baker, and undoing what failed."""
