M104 S{bed}
{a} {{x}}
