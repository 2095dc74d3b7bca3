"""Where trackers go: candidates on the body, tried in sets, ranked with their ties."""
