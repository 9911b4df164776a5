//! What the tests share: scene generators, matchers and the table of tolerances.
