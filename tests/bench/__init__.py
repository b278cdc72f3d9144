"""What the package costs, beside other implementations of the same estimator; see ``__main__.py``.

Importing gtao first settles the LLVM library before anything imports Dr.Jit.
"""

import gtao  # noqa: F401  (before anything that imports Dr.Jit)
