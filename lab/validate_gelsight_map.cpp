int unused_validate_gelsight_map = 0;
