"""The hardware of 2002-2007: what fragment programs cost on the graphics cards of that time.

The modules compute the time of a program on a card, step by step:

* ``cards``: The figures and limits of the cards, with sources (``cards.json``).
* ``static_costs``: The instructions of each kernel, from Mesa's compiler for the card. The GLSL
  text cannot show them: the compiler merges fetches and removes unused code.
* ``trace``: The kernel that each ray runs in each step, recorded from real passes.
* ``issue``: How often a group of pixels that branch together issues a kernel, and how many of its
  pixels wait. Counters in shaders cannot show how long a ray waits for its neighbours.
* ``image_issues``: The counts of ``issue`` for an image, from samples of the image's rays.
  For packets, this module uses ``packet_trace`` and ``warp_packets``.
* ``machine_model``: Predicts seconds from these counts, with no fitted constant. ``nv40_pairing``
  counts NV40's clocks.
* ``program_forms``: The forms in which a card can run a method's kernels.
* ``prediction``: `predict`, all these steps in one call.
* ``era_time``, ``era_rays``: The predicted time of rays that were traced in the era form
  (docs/era.md), for ``render --era``.
* ``published_kernels``: The instruction counts that papers printed.
* ``table_reads``: The texels that rays read, computed from a trace.
* ``machines``, ``loop_costs``, ``local_store``: Times of machines with ray tracing units, and of
  the Cell.
* ``methods_on_cards``: The methods that a card could have run.
"""
