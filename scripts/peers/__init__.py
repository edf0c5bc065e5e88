"""The same drilling in other engines, each as its expert would set it up.

Every engine offers a class with ``name``, ``sweep`` (its settings from coarse to fine), ``run`` and ``acceleration``;
see :class:`peers.problem.Engine`. Set-up (parsing the model, binding laws) happens in the constructor, time is that of
``run`` alone.
"""
