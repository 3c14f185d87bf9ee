"""Proofs for every number of machines: ``fsmkit check SYSTEM --set N=any``.

The method is view abstraction: P. A. Abdulla, F. Haziza, L. Holik, *Parameterized verification
through view abstraction*, STTT 18 (2016). `family` defines the class of systems and rejects all
others, `windows` computes the abstraction, `prove` combines it with explicit searches.
"""
