"""From the posterior to the answer: names, ambiguities, sizes, verdict, sentence."""
