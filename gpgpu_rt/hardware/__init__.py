"""Period hardware: what fragment programs cost on the cards that the survey's papers ran on.

From a program to a time on a card, one noun a file:

* ``cards``: the cards' figures, each with its source (``cards.json``), and what each refuses;
* ``compiler``: a program's instructions, from a compiler that works on four components as those
  cards did (Mesa's own, which prints them). **Why a compiler and not the GLSL text**: what is
  written three times is fetched once, and what a define leaves out is not there;
* ``program``: those instructions as a tree of blocks, branches and loops; what each region costs;
* ``translate``, ``emulate``: an emulated fragment processor in numpy, bit for bit the renderer,
  which counts what runs at every width that fragments may be bound together in. **Why not
  counters in the shaders**: a counter tells how often a ray did something, not what its neighbours
  made it wait for;
* ``sample``: whole tiles of an image through it, as neighbours go together on hardware;
* ``counters``: operations, fetches and bytes of every pass of a call, by ``turns`` of loops also;
* ``model``: seconds from counted work, with one constant a card;
* ``methods_on_cards``: which methods a card could have run.

What compiles needs Mesa 22.3's softpipe: `compiler.not_countable` says why where it is not there,
and `program.NotCountable` is raised. The cards and the model need nothing.
"""
