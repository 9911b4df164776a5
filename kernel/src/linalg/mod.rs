//! Small fixed-size linear algebra without panic paths or unbounded loops.
