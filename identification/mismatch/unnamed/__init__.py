"""From structure that no physics carries to flexible terms and formulas that predict better what was not fitted."""
