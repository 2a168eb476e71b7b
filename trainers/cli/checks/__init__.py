"""What ``go1-mtl-gym doctor`` looks at, one file a subject; whatever could crash is tried in a process of its own."""
