"""Many shots, each made by ``dafnet populate`` in a process of its own: here, or on a cluster.

``lists`` reads the shots of a file; ``making`` makes one in a process of its own; ``local`` and
``cluster`` say where; ``running`` makes those that are not there yet; ``report`` tells of all.
"""
