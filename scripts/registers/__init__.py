"""The register map as SystemRDL, and what is made from that alone: VHDL, C header, names, HTML, IP-XACT."""
