def emf_rows(*a): raise NotImplementedError
