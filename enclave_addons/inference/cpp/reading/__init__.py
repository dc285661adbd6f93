"""Files in, declarations and names out: what CMake builds, the preprocessor, classes and functions, names."""
