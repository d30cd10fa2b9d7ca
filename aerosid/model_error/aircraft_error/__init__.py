"""The model error of an aircraft's equations of motion: forward by (21)-(26), and smoothed over the record."""
