"""The estimator once more, in other frameworks: what the package is compared with."""
