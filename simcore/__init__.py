"""simcore: which patient lift design drops the patient, and which presses too hard."""
