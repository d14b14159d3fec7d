"""The hardware of 2002-2007: what fragment programs cost on the graphics cards of that time.

The modules compute the time of a program on a card, step by step:

* ``cards``: The figures of the cards, each with its source (``cards.json``), and their limits.
* ``static_costs``: The instructions of each kernel after Mesa's compiler for the card compiled it.
  **Why a compiler and not the GLSL text**: the compiler merges fetches and removes unused code.
* ``trace``: The kernel that each ray runs in each step, recorded from passes that really ran.
* ``issue``: How often pixels that branch together issue each kernel, and how many of them wait.
  **Why not counters in the shaders**: a counter does not show how long a ray waited for its
  neighbours.
* ``machine_model``: Predicts seconds from these counts, with no fitted constant.
* ``era_time``: The predicted time of passes in the era form (docs/era.md), as ``render --era``
  prints it.
* ``published_kernels``: The instruction counts that papers printed for their kernels.
* ``table_reads``: The texels that rays read, from the same passes.
* ``machines``, ``loop_costs``, ``local_store``: Times of machines with ray tracing units, and of
  the Cell.
* ``methods_on_cards``: The methods that a card could have run.
"""
