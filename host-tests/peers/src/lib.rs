//! Symbols that the comparison programs load: each converts types and calls one public function.
