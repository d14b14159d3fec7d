"""The Ray Engine (Carr, Hall and Hart 2002)."""
