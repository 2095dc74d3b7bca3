"""Methods in processes of their own, and the run of a method over the frames of a take."""
